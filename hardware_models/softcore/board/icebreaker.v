// An iCEBreaker: 12 MHz to 24 MHz, and the serial line of its FT2232H.
module top (
    input  wire clk_12mhz,
    input  wire rx,
    output wire tx
);
    wire clk, locked;
    // 12 MHz * 64 / 2^5
    SB_PLL40_PAD #(.FEEDBACK_PATH("SIMPLE"), .DIVR(4'd0), .DIVF(7'd63), .DIVQ(3'd5),
                   .FILTER_RANGE(3'd1)) pll (
        .PACKAGEPIN(clk_12mhz), .PLLOUTGLOBAL(clk), .LOCK(locked), .RESETB(1'b1), .BYPASS(1'b0));

    reg [3:0] since_locked = 0;
    always @(posedge clk) since_locked <= !locked ? 4'd0 : since_locked + !since_locked[3];
    board #(.BAUD_CYCLES(8)) board (                 // 3 Mbaud
        .clk(clk), .rst(!since_locked[3]), .rx(rx), .tx(tx), .rxf_n(1'b1), .txe_n(1'b1), .rd_n(),
        .wr_n(), .data_in(8'd0), .data_out(), .drive());
endmodule
