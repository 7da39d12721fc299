// The host's port: commands are bytes that write words, and one of them is answered.
//
//     command  {memory 8, core 8, address 16, words 16}, then the words, each of WIDTH(memory) bytes
//     memory   0 to 6 a core's (core.v), 7 the list of outputs, 8 the bus: {core 8, row 16},
//              9 begin a step: {clear}, 10 answer
//     output   {what 8, core 8, place 16}; what: 0 the end of the list, 1 a spike, 2 u, 3 v
//     answer   {cycles 32}, 24 bits of each u and v, spikes 8 a byte, {crc 16}
//
// All numbers are big-endian. An answer waits until all is quiet; its outputs come in the list's order,
// u and v before spikes, the first spike in the highest bit. The crc (CRC-16, polynomial 0x1021, from 0)
// goes over all bytes since the last answer, those of this one included. A command that stops half way
// for 2^LOG_PATIENCE cycles is dropped.
module host #(
    parameter CORE = 3,
    parameter ROW = 16,
    parameter LOG_COMPARTMENTS = 10,
    parameter LOG_OUTPUTS = 9,
    parameter LOG_PATIENCE = 22
) (
    input  wire clk,
    input  wire rst,
    input  wire in_valid,
    output wire in_ready,
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
    output wire [CORE-1:0] host_core,
    output wire [ROW-1:0] host_row,
    output wire [CORE-1:0] at_core,
    output wire [15:0] at,
    output wire write,
    output wire [2:0] select,
    output wire [47:0] data,
    input  wire signed [23:0] read_u, read_v,
    input  wire read_spike
);
    localparam OUTPUTS = 4'd7, BUS = 4'd8, STEP = 4'd9, ANSWER = 4'd10;
    function [2:0] width(input [3:0] memory);
        case (memory)
            4'd0, 4'd6: width = 6;
            4'd1, 4'd4, BUS: width = 3;
            4'd3, OUTPUTS: width = 4;
            4'd2, 4'd5: width = 2;
            default: width = 1;
        endcase
    endfunction
    function [15:0] crc_of(input [15:0] from, input [7:0] octet);
        integer i;
        begin
            crc_of = from ^ {octet, 8'd0};
            for (i = 0; i < 8; i = i + 1) crc_of = crc_of << 1 ^ (crc_of[15] ? 16'h1021 : 16'h0000);
        end
    endfunction

    // Bytes to words. `left` counts the bytes of a head or a word that are still to come.
    reg [47:0] word;
    reg [2:0] left;
    reg in_head, whole;                              // whole: a word waits to be done
    reg [3:0] memory;
    reg [CORE-1:0] core;
    reg [15:0] address, words;
    reg [LOG_PATIENCE:0] patience;
    wire done;
    wire taken = in_valid & in_ready;
    wire late = patience[LOG_PATIENCE] & !taken;     // a byte that comes is no silence
    assign in_ready = !whole;
    always @(posedge clk) begin
        if (taken) word <= {word[39:0], in};
        patience <= rst | taken | whole | late ? 0 : patience + 1'b1;
        if (rst | late) begin
            left <= 5; in_head <= 1; whole <= 0;
        end else if (taken) begin
            left <= left - 1'b1;
            if (left == 0 & in_head) begin
                memory <= word[35:32]; core <= word[24 +: CORE];
                address <= word[23:8]; words <= {word[7:0], in};
                in_head <= {word[7:0], in} == 0;
                left <= {word[7:0], in} == 0 ? 3'd5 : width(word[35:32]) - 1'b1;
            end else if (left == 0) whole <= 1;
        end else if (done) begin
            whole <= 0; address <= address + 1'b1; words <= words - 1'b1;
            in_head <= words == 1;
            left <= words == 1 ? 3'd5 : width(memory) - 1'b1;
        end
    end
    assign data = word;
    assign select = memory[2:0];
    assign write = whole & memory < OUTPUTS;
    assign host_valid = whole & memory == BUS;
    assign {host_core, host_row} = {word[ROW +: CORE], word[ROW-1:0]};
    assign go = whole & memory == STEP;
    assign clear = word[0];

    // The list of outputs: an entry a cycle later, and what it names three cycles after that (chip.v).
    localparam PLACE = LOG_COMPARTMENTS, LAST = PLACE + CORE + 1;
    reg [LAST:0] outputs [0:(1 << LOG_OUTPUTS)-1];
    reg [LAST:0] output_;
    reg [LOG_OUTPUTS-1:0] next;
    always @(posedge clk) begin
        if (whole & memory == OUTPUTS)
            outputs[address[LOG_OUTPUTS-1:0]] <= {word[25:24], word[16 +: CORE], word[PLACE-1:0]};
        output_ <= outputs[next];
    end
    wire [1:0] what = output_[LAST -: 2];
    wire answering = whole & memory == ANSWER;
    assign at_core = answering ? output_[PLACE +: CORE] : core;
    assign at = answering ? output_[PLACE-1:0] : address;

    // The answer: `sending` holds what is sent, its first byte on top.
    localparam CYCLES = 2'd0, VALUES = 2'd1, CRC = 2'd2, SENT = 2'd3;
    reg [1:0] part;
    reg [31:0] sending;
    reg [2:0] octets;                                // left of it
    reg [2:0] waited;
    reg [2:0] n_spikes;
    reg [6:0] spikes;
    reg [15:0] crc;
    wire idle = octets == 0;
    wire read = waited == 3'd4;
    wire ends = what == 2'd0;
    wire put = !idle & out_ready;
    assign out_valid = !idle;
    assign out = sending[31:24];
    assign done = answering ? part == SENT & idle : whole & (!host_valid | host_ready);
    always @(posedge clk) begin
        if (taken | put) crc <= crc_of(crc, taken ? in : out);
        if (put) begin
            sending <= sending << 8; octets <= octets - 1'b1;
        end
        if (!answering) begin
            part <= CYCLES; next <= 0; waited <= 0; n_spikes <= 0;
        end else if (idle) case (part)
            CYCLES: if (quiet) begin
                sending <= cycles; octets <= 4; part <= VALUES;
            end
            VALUES: if (!read) waited <= waited + 1'b1;
            else begin
                waited <= 0;
                if (ends & n_spikes == 0) part <= CRC;
                else begin
                    if (!ends) next <= next + 1'b1;
                    if (what[1]) begin
                        sending <= {what[0] ? read_v : read_u, 8'd0}; octets <= 3;
                    end else begin
                        spikes <= {spikes[5:0], read_spike & !ends}; n_spikes <= n_spikes + 1'b1;
                        sending <= {spikes, read_spike & !ends, 24'd0}; octets <= n_spikes == 7;
                    end
                end
            end
            CRC: begin
                sending <= {crc, 16'd0}; octets <= 2; part <= SENT;
            end
            SENT: crc <= 0;
        endcase
        if (rst) begin
            octets <= 0; crc <= 0;
        end
    end
endmodule
