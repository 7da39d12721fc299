// A ULX3S: 25 MHz to 45 MHz, and the serial line of its FT231X, or an FT232H on header J1 where FIFO is 1.
module top #(
    parameter FIFO = 0
) (
    input  wire clk_25mhz,
    input  wire ftdi_txd,                            // named as FTDI's chip sees them
    output wire ftdi_rxd,
    output wire wifi_gpio0,
    input  wire rxf_n,
    input  wire txe_n,
    output wire rd_n,
    output wire wr_n,
    inout  wire [7:0] data
);
    assign wifi_gpio0 = 1'b1;                        // low would begin the ESP32's boot loader
    wire clk, locked;
    // 25 MHz / 5 * 9, of 585 MHz; the phase of CLKOP is of no concern here.
    (* FREQUENCY_PIN_CLKI = "25", FREQUENCY_PIN_CLKOP = "45", ICP_CURRENT = "12", LPF_RESISTOR = "8" *)
    EHXPLLL #(.CLKI_DIV(5), .CLKFB_DIV(9), .CLKOP_DIV(13), .CLKOP_CPHASE(6), .CLKOP_ENABLE("ENABLED"),
              .FEEDBK_PATH("CLKOP")) pll (
        .CLKI(clk_25mhz), .CLKFB(clk), .CLKOP(clk), .LOCK(locked), .RST(1'b0), .STDBY(1'b0),
        .PHASESEL0(1'b0), .PHASESEL1(1'b0), .PHASEDIR(1'b1), .PHASESTEP(1'b1), .PHASELOADREG(1'b1),
        .PLLWAKESYNC(1'b0), .ENCLKOP(1'b0));

    reg [3:0] since_locked = 0;
    always @(posedge clk) since_locked <= !locked ? 4'd0 : since_locked + !since_locked[3];
    wire drive;
    wire [7:0] data_in, data_out;
    genvar i;
    generate for (i = 0; i < 8; i = i + 1) begin : wires
        BB wire_ (.I(data_out[i]), .T(!drive), .O(data_in[i]), .B(data[i]));
    end endgenerate
    board #(.FIFO(FIFO), .BAUD_CYCLES(15)) board (   // 3 Mbaud
        .clk(clk), .rst(!since_locked[3]), .rx(ftdi_txd), .tx(ftdi_rxd), .rxf_n(rxf_n),
        .txe_n(txe_n), .rd_n(rd_n), .wr_n(wr_n), .data_in(data_in), .data_out(data_out), .drive(drive));
endmodule
