// The host's port: commands of four bytes, the first of them says what the other 24 bits are.
//
//     0          nothing; three of them find the begin of a command again
//     1 data     data <- {data[23:0], 24 bits}
//     2 write    {core[4:0], select[2:0], address[15:0]}: a word of a memory <- data
//     3 message  {core[7:0], row[15:0]}: a spike of the host's, after `step`
//     4 step     bit 0: clear. Begins a step
//     5 wait     answers with the cycles of the step in 3 bytes, once all is quiet
//     6 read     {core[4:0], which[2:0], address[15:0]}: answers with u (0), v (1) or spike (2) of
//                data[15:0] compartments from there on, in 3 bytes each
//
// Answers are little-endian. A command waits for the one before, so the sender must not send more
// than 4 bytes ahead of one that takes longer than a command: a wait, a read, or messages to a full bus.
module host #(
    parameter CORE = 3,
    parameter ROW = 16
) (
    input  wire clk,
    input  wire rst,
    input  wire in_valid,
    input  wire [7:0] in,
    output wire out_valid,
    input  wire out_ready,
    output wire [7:0] out,
    output wire go,
    output wire clear,
    input  wire quiet,
    input  wire [31:0] cycles,
    output wire host_valid,
    input  wire host_ready,
    output wire [CORE-1:0] at_core,
    output wire [15:0] at,
    output wire [2:0] select,
    output wire write,
    output reg  [47:0] data,
    input  wire [23:0] read_u, read_v,
    input  wire read_spike
);
    localparam DATA = 8'd1, WRITE = 8'd2, MESSAGE = 8'd3, STEP = 8'd4, WAIT = 8'd5, READ = 8'd6;
    reg [31:0] command, coming;
    reg [1:0] bytes;                                 // of the command that comes
    reg under_way;
    wire [7:0] what = command[31:24];
    reg [15:0] offset;
    assign at_core = what == MESSAGE ? command[16 +: CORE] : command[19 +: CORE];
    assign select = command[18:16];
    assign at = command[15:0] + (what == READ ? offset : 16'd0);
    assign write = under_way & what == WRITE;
    assign go = under_way & what == STEP;
    assign clear = command[0];
    assign host_valid = under_way & what == MESSAGE;

    // An answer of three bytes, once what it is about can be read.
    reg [1:0] left, delay;
    reg [23:0] answer;
    assign out_valid = left != 0;
    assign out = answer[7:0];
    wire answers = what == WAIT | what == READ;
    wire ready = what == WAIT ? quiet : delay == 2'd2;
    wire last = what == WAIT | offset + 1'b1 == data[15:0];
    wire done = answers ? out_valid & out_ready & left == 1 & last
              : what == MESSAGE ? host_ready : 1'b1;
    always @(posedge clk)
        if (rst) begin
            bytes <= 0; under_way <= 0; left <= 0;
        end else begin
            if (in_valid) begin
                coming <= {coming[23:0], in};
                // Zeros in front of a command are no command.
                bytes <= bytes == 0 & in == 0 ? 2'd0 : bytes + 1'b1;
                if (bytes == 3) begin
                    command <= {coming[23:0], in}; under_way <= 1; left <= 0; delay <= 0; offset <= 0;
                end
            end
            if (under_way) begin
                if (what == DATA) data <= {data[23:0], command[23:0]};
                if (answers) begin
                    if (left == 0) begin
                        delay <= delay + 1'b1;
                        if (ready) begin
                            left <= 3;
                            answer <= what == WAIT ? cycles[23:0] : select == 0 ? read_u
                                    : select == 1 ? read_v : {23'd0, read_spike};
                        end
                    end else if (out_ready) begin
                        left <= left - 1'b1; answer <= answer >> 8;
                        if (left == 1) begin
                            delay <= 0; offset <= offset + 1'b1;
                        end
                    end
                end
                if (done & !(in_valid & bytes == 3)) under_way <= 0;
            end
        end
endmodule
