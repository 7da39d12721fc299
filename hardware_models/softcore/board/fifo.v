// Bytes through an FT232H or FT2232H in "245 asynchronous FIFO" mode: eight wires of data, four of control.
//
//     to read    while rxf_n is low: rd_n low, data is there within 14 ns, rd_n high
//     to write   while txe_n is low: data, 5 ns later wr_n low, both held
//
// The chip wants pulses of 30 ns or more, and says up to 49 ns late that it is full or empty: PULSE cycles of the clock
// take 30 ns, GAP cycles 49 ns and the synchroniser's two.
module fifo #(
    parameter PULSE = 2,
    parameter GAP = 5
) (
    input  wire clk,
    input  wire rst,
    input  wire rxf_n,
    input  wire txe_n,
    output reg  rd_n,
    output reg  wr_n,
    input  wire [7:0] data_in,
    output reg  [7:0] data_out,
    output reg  drive,                               // data_out is on the wires
    output reg  in_valid,                            // a byte came, for one cycle
    input  wire in_ready,
    output reg  [7:0] in,
    input  wire out_valid,
    output wire out_ready,
    input  wire [7:0] out
);
    localparam REST = 2'd0, READ = 2'd1, WRITE = 2'd2, PAUSE = 2'd3;
    reg [1:0] state, filled, room;                   // two cycles of the chip's wires
    reg [3:0] left;
    wire reads = state == REST & !filled[1] & in_ready & !in_valid;
    wire writes = state == REST & !room[1] & out_valid & !reads;
    assign out_ready = writes;
    always @(posedge clk) begin
        filled <= {filled[0], rxf_n}; room <= {room[0], txe_n};
        in_valid <= 0;
        if (left != 0) left <= left - 1'b1;
        if (rst) begin
            state <= PAUSE; left <= GAP; rd_n <= 1; wr_n <= 1; drive <= 0;
        end else case (state)
            REST: if (reads) begin
                state <= READ; left <= PULSE - 1; rd_n <= 0;
            end else if (writes) begin
                state <= WRITE; left <= PULSE; data_out <= out; drive <= 1;
            end
            READ: if (left == 0) begin
                state <= PAUSE; left <= GAP; rd_n <= 1; in <= data_in; in_valid <= 1;
            end
            WRITE: begin
                wr_n <= left == 0;
                if (left == 0) begin
                    state <= PAUSE; left <= GAP;
                end
            end
            PAUSE: begin
                drive <= 0;
                if (left == 0) state <= REST;
            end
        endcase
    end
endmodule
