// Self-checking testbench of PaddleDrive.
`timescale 1ns/1ps
module tb_paddle;
    logic               clk_pwm = 1'b0, clk_logic = 1'b0, rst_n = 1'b0;
    logic signed [17:0] pos, bench_pos = 0, plant_pos = 0;
    logic               pos_valid = 1'b0, closed = 1'b0;
    logic               in1, in2, sleep_n;
    int                 phase = 0, fails = 0;

    // 20 MHz, and 5 MHz with every fourth edge, in the same instant.
    always begin
        #25;
        clk_pwm   = 1'b1;
        if (phase == 0) clk_logic = 1'b1;
        if (phase == 2) clk_logic = 1'b0;
        phase = (phase + 1) % 4;
        #25;
        clk_pwm   = 1'b0;
    end

    assign pos = closed ? plant_pos : bench_pos;

    PaddleDrive dut (.*);

    // The bridge by itself, for the direction that a push never has.
    logic signed [11:0] probe = 12'sd1000;
    logic               p1, p2;
    DutyBridge bare (.clk_logic, .rst_n, .drive(probe), .clk_pwm, .in1(p1), .in2(p2));

    function automatic void check(input bit ok, input string what, input int got, input int want);
        if (ok) $display("PASS  %s: %0d", what, got);
        else begin
            fails++;
            $display("FAIL  %s: %0d, expected %0d", what, got, want);
        end
    endfunction

    int up, down, brake, low, pup, pdown;
    task automatic one_period();             // over 2047 PWM clocks, away from edges
        repeat (5000) @(negedge clk_pwm);
        up = 0; down = 0; brake = 0; low = 0; pup = 0; pdown = 0;
        repeat (2047) begin
            @(negedge clk_pwm);
            case ({in1, in2})
                2'b10: up++;
                2'b01: down++;
                2'b11: brake++;
                default: low++;
            endcase
            if (p1 && !p2) pup++;
            if (p2 && !p1) pdown++;
        end
    endtask

    // ------------------------------------------------------------- the motor
    real amps, omega, theta, hand, hand_speed, volts, t_loop, lowest, highest, total;
    int  samples;
    localparam real DT = 50.0e-9;
    localparam real TAU = 651.8986;          // counts a radian

    always @(negedge clk_pwm) if (closed) begin
        t_loop     = t_loop + DT;
        hand_speed = (t_loop < 0.060) ? 2.2 / 0.060 : 0.0;
        hand       = hand + hand_speed * DT;
        volts      = sleep_n ? 24.0 * (real'(in1) - real'(in2)) : 0.0;
        amps       = amps + DT * (volts - 2.346 * amps - 25.9e-3 * omega) / 0.226e-3;
        omega      = omega + DT * (25.9e-3 * amps - 1.3e-6 * omega
                     + 0.3 * (hand - theta) + 0.1e-3 * (hand_speed - omega)) / 1.37e-6;
        theta      = theta + DT * omega;
        plant_pos  = 18'($rtoi(theta * TAU + 65536.0) - 65536);
        if (t_loop > 0.100) begin
            if (theta < lowest)  lowest  = theta;
            if (theta > highest) highest = theta;
            total = total + theta; samples = samples + 1;
        end
    end

    initial begin
        repeat (6) @(negedge clk_logic);
        check(sleep_n == 0, "asleep in reset", int'(sleep_n), 0);
        rst_n = 1'b1;
        repeat (20) @(negedge clk_logic);
        check(sleep_n == 0, "asleep before a position", int'(sleep_n), 0);
        pos_valid = 1'b1; bench_pos = -18'sd300;
        repeat (3) @(negedge clk_logic);
        check(sleep_n == 1, "awake with a position", int'(sleep_n), 1);
        one_period();
        check(brake == 2047, "braking before the wall", brake, 2047);
        check(pup == 1000 && pdown == 0, "bridge, +1000: IN1 high, IN2 low", pup, 1000);
        probe = -12'sd2048;

        bench_pos = 18'sd978;
        one_period();
        check(brake == 2047, "braking at the wall", brake, 2047);
        check(pup == 0 && pdown == 2047, "bridge, -2048: IN1 low, IN2 high", pdown, 2047);

        bench_pos = 18'sd1028;
        repeat (3000) @(negedge clk_logic);  // speed back to 0
        one_period();
        check(down == 190 * 50 / 16, "IN1 low, IN2 high, 50 beyond", down, 190 * 50 / 16);
        check(up == 0 && low == 0, "never the other way", up + low, 0);

        bench_pos = 18'sd131071;
        repeat (3000) @(negedge clk_logic);
        one_period();
        check(down == 2047, "limited to full duty", down, 2047);

        bench_pos = 18'sd1078;
        repeat (3000) @(negedge clk_logic);
        for (int i = 0; i < 8; i++) begin    // 5 counts a sample: 20 over the trail
            bench_pos = bench_pos + 18'sd5;
            repeat (500) @(negedge clk_logic);
        end
        check(int'(dut.drive) == -((190 * 140 + 16 * 20) / 16), "damping going in", int'(dut.drive), -((190 * 140 + 16 * 20) / 16));

        bench_pos = -18'sd131072;
        repeat (3000) @(negedge clk_logic);
        one_period();
        check(brake == 2047, "braking far behind", brake, 2047);

        pos_valid = 1'b0;
        bench_pos = 18'sd2000;
        repeat (4000) @(negedge clk_logic);
        bench_pos = 18'sd2000;
        repeat (5100) @(negedge clk_logic);
        check(sleep_n == 0, "asleep without positions", int'(sleep_n), 0);

        rst_n = 1'b0;
        repeat (4) @(negedge clk_logic);
        closed = 1'b1; pos_valid = 1'b1; rst_n = 1'b1;
        amps = 0; omega = 0; theta = 0; hand = 0; t_loop = 0; total = 0; samples = 0;
        lowest = 1.0e9; highest = -1.0e9;
        while (t_loop < 0.120) @(negedge clk_pwm);
        begin
            automatic real k = 190.0 / 16.0 / 2047.0 * (25.9e-3 * 24.0 / 2.346) * TAU;
            automatic real want = (0.3 * 2.2 + k * 1.5) / (0.3 + k);
            automatic real mean = total / samples;
            $display("INFO  %.3f N.m/rad, rests at %.4f rad (sum of springs %.4f), swing %.2f mrad",
                     k, mean, want, 1000.0 * (highest - lowest));
            check(mean - want < 0.01 && want - mean < 0.01, "rest position, 0.1 mrad", $rtoi(mean * 10000), $rtoi(want * 10000));
            check(highest - lowest < 0.010, "swing below 10 mrad, urad", $rtoi((highest - lowest) * 1.0e6), 10000);
        end

        if (fails == 0) $display("PaddleDrive: ALL PASSED");
        else            $display("PaddleDrive: %0d FAILED", fails);
        $finish;
    end
endmodule
