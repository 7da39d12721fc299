// From a message to weights: the row at its address, one weight a cycle after two cycles of header.
//
//     word 0  {shift[4:0], dense, entries-1[9:0]}      word 1  {-, first target}
//     sparse: entries of {gap[7:0], weight[7:0]}       target <- target + gap
//     dense:  two weights a word, low byte first       target <- target + 1, after each
//     what is added to the target: weight 2^shift
//
// The memory has one port, so that it fits single-port RAM; the host writes it between steps.
module walker #(
    parameter LOG_COMPARTMENTS = 10,
    parameter ROW = 16,                              // bits of an address
    parameter WORDS = 65536,                         // of synapse memory
    parameter WIDTH = 22,
    parameter LOG_QUEUE = 9
) (
    input  wire clk,
    input  wire rst,
    input  wire in_valid,
    output wire in_ready,
    input  wire [ROW-1:0] in_row,
    output reg  add,
    output reg  [LOG_COMPARTMENTS-1:0] target,
    output reg  signed [WIDTH-1:0] weight,
    output wire idle,
    input  wire write,
    input  wire [ROW-1:0] write_at,
    input  wire [15:0] in
);
    localparam HEADER = 2'd0, FIRST = 2'd1, ENTRIES = 2'd2;
    wire waiting, drained;
    wire [ROW-1:0] row;
    reg [1:0] state;
    wire take = state == HEADER & waiting;
    queue #(.WIDTH(ROW), .LOG_DEPTH(LOG_QUEUE)) rows (
        .clk(clk), .rst(rst), .push(in_valid), .ready(in_ready), .in(in_row),
        .pop(take), .valid(waiting), .head(row), .empty(drained));

    reg [15:0] memory [0:WORDS-1];
    reg [15:0] word;
    reg [ROW-1:0] next;
    wire [ROW-1:0] at = write ? write_at : state == HEADER ? row : next;
    always @(posedge clk)
        if (write) memory[at] <= in;
        else word <= memory[at];

    reg dense, odd;
    reg [4:0] shift;
    reg [9:0] left;
    always @(posedge clk)
        if (rst) state <= HEADER;
        else case (state)
            HEADER: if (waiting) begin
                state <= FIRST; next <= row + 1'b1;
            end
            FIRST: begin
                {shift, dense, left} <= word; odd <= 0;
                state <= ENTRIES; next <= next + 1'b1;
            end
            default: begin
                if (!dense | odd) next <= next + 1'b1;
                odd <= !odd; left <= left - 1'b1;
                if (left == 0) state <= HEADER;
            end
        endcase

    // word holds the first target, or an entry; then an entry is taken apart; then it is placed.
    reg is_first, is_entry, is_odd, apart, apart_dense;
    reg [7:0] gap;
    reg signed [7:0] byte_;
    reg [LOG_COMPARTMENTS-1:0] from;
    wire [LOG_COMPARTMENTS-1:0] place = apart_dense ? from : from + gap;
    wire signed [WIDTH-1:0] wide = byte_;
    always @(posedge clk) begin
        is_odd <= odd; apart_dense <= dense;
        gap <= word[15:8]; byte_ <= dense & is_odd ? word[15:8] : word[7:0];
        if (is_first) from <= word[LOG_COMPARTMENTS-1:0];
        else if (apart) from <= place + apart_dense;
        target <= place; weight <= wide <<< shift;
    end
    always @(posedge clk)
        if (rst) {is_first, is_entry, apart, add} <= 0;
        else begin
            is_first <= state == FIRST; is_entry <= state == ENTRIES;
            apart <= is_entry; add <= apart;
        end
    assign idle = drained & state == HEADER & !(is_first | is_entry | apart | add);
endmodule
