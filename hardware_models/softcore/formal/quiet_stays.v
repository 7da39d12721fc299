// For a bounded proof: once the barrier is quiet it stays so until `go` or the host, and each message
// that the bus takes reaches its core, once.
//
// Two cores are stood in for by what core.v promises: one sends only while it is busy, keeps a
// message until it is taken, and is made busy by `go` or by a message alone. All else is arbitrary.
module quiet_stays (
    input wire clk,
    input wire go,
    input wire host_sends,
    input wire host_core,
    input wire [1:0] sends,
    input wire [1:0] to,
    input wire [1:0] ends,
    input wire [1:0] room
);
    reg begun = 0;
    always @(posedge clk) begun <= 1;
    reg [1:0] busy = 0, sending = 0, target = 0;
    reg host_valid = 0, host_target = 0;
    wire [2:0] ready;
    wire [1:0] arrives;
    wire empty, moved, quiet, row;
    wire [31:0] cycles;
    wire begins = go & begun & empty & busy == 0 & !host_valid;
    bus #(.CORES(2), .CORE(1), .ROW(1)) bus (
        .clk(clk), .rst(!begun), .in_valid({host_valid, sending}), .in_ready(ready),
        .in({host_target, 1'b0, target[1], 1'b0, target[0], 1'b0}),
        .out_valid(arrives), .out_ready(room), .out_row(row), .empty(empty), .moved(moved));
    barrier #(.CORES(2)) barrier (
        .clk(clk), .rst(!begun), .go(begins), .idle(~busy), .bus_empty(empty), .quiet(quiet),
        .cycles(cycles));

    wire [1:0] arrived = arrives & room;
    wire [1:0] sent = sending & ready[1:0];
    always @(posedge clk) if (begun) begin
        busy <= {2{begins}} | arrived | (busy & ~(ends & ~sending & ~sends));
        sending <= (sending & ~sent) | (~sending & busy & sends);
        target <= (target & sending) | (to & ~sending);
        host_valid <= (host_valid & !ready[2]) | (!host_valid & host_sends);
        if (!host_valid) host_target <= host_core;
    end

    // Messages to core 1 that were taken onto the bus and did not arrive yet.
    reg [3:0] under_way = 0;
    wire taken = |(sent & target) | (host_valid & ready[2] & host_target);
    reg was_quiet = 0, stirred = 0;
    always @(posedge clk) if (begun) begin
        under_way <= under_way + taken - arrived[1];
        was_quiet <= quiet; stirred <= begins | host_valid;
    end
    reg clear_of_reset = 0;
    always @(posedge clk) clear_of_reset <= begun;
    always @* if (clear_of_reset) begin
        assert (under_way == arrives[1]);
        assert (arrives != 2'b11);
        assert (!quiet | sending == 0);
        assert (!(was_quiet & !stirred) | quiet | begins);
    end
endmodule
