// The end of a step: no core has anything to do, and no message is under way.
//
//     quiet = all cores idle and the bus empty, not in the cycle of `go`
//     cycles = those of the last step, from `go` to quiet
//
// Only a core that is not idle sends, and only a message makes an idle core busy, so quiet stays
// until the next step begins or the host sends.
module barrier #(
    parameter CORES = 1
) (
    input  wire clk,
    input  wire rst,
    input  wire go,
    input  wire [CORES-1:0] idle,
    input  wire bus_empty,
    output wire quiet,
    output reg  [31:0] cycles
);
    assign quiet = &idle & bus_empty & !go;
    always @(posedge clk)
        if (rst) cycles <= 0;
        else if (go) cycles <= 1;
        else if (!quiet) cycles <= cycles + 1'b1;
endmodule
