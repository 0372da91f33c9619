// Self-checking testbench of KneeCtl.  Prints PASS or FAIL lines and a summary.
`timescale 1ns/1ps
`default_nettype none
module tb_knee;

    reg               clk = 1'b0;
    reg               rst = 1'b1;
    reg               bench_a = 1'b1, bench_b = 1'b1;
    reg        [9:0]  gain = 10'd95;
    reg signed [15:0] wall = 16'sd100;
    reg               closed = 1'b0;
    wire              pwm, dir, touching;
    wire       [15:0] position;
    wire              enc_a, enc_b;

    always #50 clk = ~clk;

    KneeCtl dut (.clk(clk), .rst(rst), .enc_a(enc_a), .enc_b(enc_b), .gain(gain),
                 .wall(wall), .pwm(pwm), .dir(dir), .touching(touching),
                 .position(position));

    // The modulator by itself, for the direction that a push never has.
    reg  [9:0] probe_mag = 10'd0;
    reg        probe_fwd = 1'b0;
    wire       probe_pwm, probe_dir;
    DutyGen modulator (.clk(clk), .rst(rst), .magnitude(probe_mag), .forward(probe_fwd),
                       .pwm(probe_pwm), .dir(probe_dir));

    integer fails = 0;

    task check(input integer ok, input [48*8-1:0] what, input integer got, input integer want);
        begin
            if (ok != 0) $display("PASS  %0s: %0d", what, got);
            else begin
                fails = fails + 1;
                $display("FAIL  %0s: %0d, expected %0d", what, got, want);
            end
        end
    endtask

    // ------------------------------------------------ open loop: step the lines
    task hop(input integer n, input integer clocks);   // n > 0: 00 01 11 10
        integer k;
        begin
            for (k = 0; k < (n < 0 ? -n : n); k = k + 1) begin
                if (n > 0) begin
                    if (bench_a == bench_b) bench_b = ~bench_b; else bench_a = ~bench_a;
                end else begin
                    if (bench_a == bench_b) bench_a = ~bench_a; else bench_b = ~bench_b;
                end
                repeat (clocks) @(posedge clk);
                #13;                                    // not on an edge
            end
        end
    endtask

    function integer where(input dummy);
        where = $signed(position) + (dummy ? 0 : 0);
    endfunction

    integer high, wrong_dir, probe_high, probe_wrong;
    task one_period(input want_dir);                    // counts over 1023 clocks
        integer k;
        begin
            repeat (2100) @(posedge clk);               // let a period begin
            high = 0; wrong_dir = 0; probe_high = 0; probe_wrong = 0;
            for (k = 0; k < 1023; k = k + 1) begin
                @(posedge clk); #1;
                if (pwm) high = high + 1;
                if (dir != want_dir) wrong_dir = wrong_dir + 1;
                if (probe_pwm) probe_high = probe_high + 1;
                if (probe_dir != probe_fwd) probe_wrong = probe_wrong + 1;
            end
        end
    endtask

    // ------------------------------------------------ closed loop: the motor
    real    amps = 0.0, omega = 0.0, theta = 0.0, hand = 0.0, hand_speed = 0.0, volts;
    real    t_loop = 0.0, lowest, highest, total, peak_theta;
    integer samples;
    integer counts;
    reg     plant_a = 0, plant_b = 0;
    localparam real DT = 100.0e-9;

    always @(posedge clk) if (closed) begin
        t_loop     = t_loop + DT;
        hand_speed = (t_loop < 0.060) ? 2.2 / 0.060 : 0.0;
        hand       = hand + hand_speed * DT;
        volts      = pwm ? (dir ? 24.0 : -24.0) : 0.0;
        amps       = amps + DT * (volts - 2.346 * amps - 25.9e-3 * omega) / 0.226e-3;
        omega      = omega + DT * (25.9e-3 * amps - 1.3e-6 * omega
                     + 0.3 * (hand - theta) + 0.1e-3 * (hand_speed - omega)) / 1.37e-6;
        theta      = theta + DT * omega;
        counts     = $rtoi(theta * 651.8986 + 65536.0) - 65536;   // floor
        plant_a    = counts[1];
        plant_b    = counts[1] ^ counts[0];
        if (theta > peak_theta) peak_theta = theta;
        if (t_loop > 0.100) begin
            if (theta < lowest)  lowest  = theta;
            if (theta > highest) highest = theta;
            total = total + theta; samples = samples + 1;
        end
    end

    assign enc_a = closed ? plant_a : bench_a;
    assign enc_b = closed ? plant_b : bench_b;

    task push_into_wall(input [9:0] g, input integer judge);
        real k, want, mean;
        begin
            rst = 1; closed = 1; gain = g; wall = 16'sd978;
            amps = 0.0; omega = 0.0; theta = 0.0; hand = 0.0; t_loop = 0.0;
            lowest = 1.0e9; highest = -1.0e9; total = 0.0; samples = 0; peak_theta = 0.0;
            repeat (4) @(posedge clk);
            #13 rst = 0;
            while (t_loop < 0.120) @(posedge clk);
            k    = g / 16.0 / 1023.0 * (25.9e-3 * 24.0 / 2.346) * 651.8986;
            want = (0.3 * 2.2 + k * 1.5) / (0.3 + k);
            mean = total / samples;
            $display("INFO  gain %0d: %.3f N.m/rad, rests at %.4f rad (sum of springs %.4f), swing %.2f mrad, peak %.4f rad",
                     g, k, mean, want, 1000.0 * (highest - lowest), peak_theta);
            if (judge != 0) begin
                check(mean - want < 0.01 && want - mean < 0.01, "rest position, 0.1 mrad", $rtoi(mean * 10000), $rtoi(want * 10000));
                check(highest - lowest < 0.010, "swing at rest below 10 mrad, urad", $rtoi((highest - lowest) * 1.0e6), 10000);
                check(counts - where(0) <= 1 && where(0) - counts <= 1, "position follows the shaft", where(0), counts);
            end
            closed = 0;
        end
    endtask

    initial begin
        // Reset with both lines high: no step may be seen afterwards.
        repeat (2) @(posedge clk);
        #13 rst = 0;
        repeat (10) @(posedge clk);
        #13;
        check(where(0) == 0, "count after reset at lines 11", where(0), 0);

        hop(10, 4);   repeat (5) @(posedge clk); #13;
        check(where(0) == 10, "ten steps forward", where(0), 10);
        hop(-25, 4);  repeat (5) @(posedge clk); #13;
        check(where(0) == -15, "twenty-five back", where(0), -15);
        hop(115, 4);  repeat (5) @(posedge clk); #13;
        check(where(0) == 100, "at the wall", where(0), 100);
        check(touching == 0, "lamp at the wall", touching, 0);
        one_period(1'b1);
        check(high == 0, "duty at the wall", high, 0);

        hop(50, 4);
        repeat (4100) @(posedge clk);                   // speed back to 0
        check(touching == 1, "lamp 50 beyond", touching, 1);
        one_period(1'b0);
        check(high == 95 * 50 / 16, "duty 50 beyond", high, 95 * 50 / 16);
        check(wrong_dir == 0, "negative throughout", wrong_dir, 0);

        gain = 10'd1023; probe_mag = 10'd7; probe_fwd = 1'b1;
        one_period(1'b0);
        check(probe_high == 7 && probe_wrong == 0, "modulator, 7 forward", probe_high, 7);
        check(high == 1023, "limited to full duty", high, 1023);

        gain = 10'd95; wall = -16'sd20;
        one_period(1'b0);
        check(high == 95 * 170 / 16, "duty 170 beyond wall at -20", high, 95 * 170 / 16);
        wall = 16'sd100;

        // A count every 100 clocks is 20 a VDIV.
        hop(60, 100); repeat (6) @(posedge clk); #13;
        check(dut.magnitude == (95 * 110 + 16 * 20) / 16, "damping going in", dut.magnitude, (95 * 110 + 16 * 20) / 16);
        hop(-60, 100); repeat (6) @(posedge clk); #13;
        check(dut.magnitude == (95 * 50 - 16 * 20) / 16, "damping going out", dut.magnitude, (95 * 50 - 16 * 20) / 16);

        hop(-60, 4);
        one_period(1'b1);
        check(high == 0 && wrong_dir == 0, "released", high, 0);
        check(touching == 0, "lamp off", touching, 0);

        push_into_wall(10'd95, 1);
        push_into_wall(10'd142, 1);
        push_into_wall(10'd600, 0);

        if (fails == 0) $display("KneeCtl: ALL PASSED");
        else            $display("KneeCtl: %0d FAILED", fails);
        $finish;
    end

endmodule
`default_nettype wire
