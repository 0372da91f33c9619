//! The Verilog around a block that nextpnr times.

use hpu_datapath::AnyBlock;
use hpu_signal::Signal;

/// Returns the Verilog of a module `hpu_bench` with four pins around a synthesised block.
///
/// Every input bit (`rst` too) comes from a register on `clk`, and every output bit goes to one. So a combinational
/// block has a clock to be timed by, and a clocked block pays for its ports as it would between other blocks. A shift
/// register on the clock `shift` feeds the inputs and another one folds the outputs, so that wide ports need no pins.
/// Paths between the clocks take no part in the frequency of `clk`. The bench is made of primitives, so that the
/// netlist of the block is timed as it was counted.
pub fn bench(block: &dyn AnyBlock) -> String {
    let (inputs, outputs) = (block.inputs(), block.outputs());
    let mut connections = Vec::new();
    let mut ins = 0;
    if block.clocked() {
        connections.extend([".clk(clk)".to_string(), ".rst(source[0])".to_string()]);
        ins = 1;
    }
    ins = connect(&mut connections, "source", &inputs, ins);
    let outs = connect(&mut connections, "answer", &outputs, 0);
    format!(
        "module hpu_bench(input clk, input shift, input feed, output fold);
  wire [{ins}:0] fed; wire [{outs}:0] folded;
  wire [{ins}-1:0] source; wire [{outs}-1:0] answer, sink, mixed;
  assign fed[0] = feed; assign folded[0] = 1'b0; assign fold = folded[{outs}];
  {name} dut({connections});
  genvar i;
  generate
    for (i = 0; i < {ins}; i = i + 1) begin : inputs
      SB_DFF next(.C(shift), .D(fed[i]), .Q(fed[i + 1]));
      SB_DFF register(.C(clk), .D(fed[i + 1]), .Q(source[i]));
    end
    for (i = 0; i < {outs}; i = i + 1) begin : outputs
      SB_DFF register(.C(clk), .D(answer[i]), .Q(sink[i]));
      SB_LUT4 #(.LUT_INIT(16'h6666)) mix(.I0(sink[i]), .I1(folded[i]), .I2(1'b0), .I3(1'b0), .O(mixed[i]));
      SB_DFF next(.C(shift), .D(mixed[i]), .Q(folded[i + 1]));
    end
  endgenerate
endmodule
",
        name = block.name(),
        connections = connections.join(", ")
    )
}

/// Connects ports to consecutive bits of a wire from bit `first` on. Returns the number of the bit after the last one.
fn connect(connections: &mut Vec<String>, wire: &str, ports: &[Signal], first: u32) -> u32 {
    ports.iter().fold(first, |low, port| {
        let next = low + port.format.width();
        connections.push(format!(".{}({wire}[{}:{low}])", port.name, next - 1));
        next
    })
}
