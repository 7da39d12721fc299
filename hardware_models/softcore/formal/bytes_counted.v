// For a bounded proof: each byte that the host's port takes counts, also one that comes in the cycle
// in which a command that stopped half way would be dropped.
//
// The host sends `begin a step` again and again, with pauses of any length. The bytes of a command
// are counted here, anew after a pause of 2^LOG_PATIENCE cycles.
module bytes_counted (
    input wire clk,
    input wire in_valid,
    input wire quiet
);
    localparam LOG_PATIENCE = 2;
    reg begun = 0;
    always @(posedge clk) begun <= 1;
    reg [2:0] n = 0;                                 // bytes of a command that were taken
    reg [LOG_PATIENCE:0] pause = 0;
    reg whole = 0;
    wire in_ready, go;
    wire [7:0] in = n == 0 ? 8'd9 : n == 5 ? 8'd1 : 8'd0;
    host #(.LOG_PATIENCE(LOG_PATIENCE), .LOG_OUTPUTS(1)) host (
        .clk(clk), .rst(!begun), .in_valid(in_valid & begun), .in_ready(in_ready), .in(in),
        .out_valid(), .out_ready(1'b1), .out(), .go(go), .clear(), .quiet(quiet), .cycles(32'd0),
        .host_valid(), .host_ready(1'b1), .host_core(), .host_row(), .at_core(), .at(), .write(),
        .select(), .data(), .read_u(24'd0), .read_v(24'd0), .read_spike(1'b0));

    wire taken = in_valid & begun & in_ready;
    wire silent = pause[LOG_PATIENCE] & !taken;
    always @(posedge clk) if (begun) begin
        pause <= taken | whole | silent ? 0 : pause + 1'b1;
        whole <= taken & n == 6;
        n <= silent ? 0 : taken ? (n == 6 ? 0 : n + 1'b1) : n;
    end
    always @* if (begun) assert (go == whole);
endmodule
