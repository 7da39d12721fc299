// The update of one compartment, one a cycle, five cycles late.
//
//     u <- wrap24(decay(u, keep_u) + q)
//     v <- clip(decay(v, keep_v) + wrap24(u + bias), vmin, vmax);   0 while refractory > 0
//     spike = v > vth;   v <- 0 where it spikes
//     refractory <- max((spike ? delay : refractory) - 1, 0)
//     decay(x, keep) = sign(x) (|x| keep >> 12)
//
// Source: nengo-loihi 1.1.0, emulator/interface.py; the same as backends/native/kernel.py.
module neuron #(
    parameter TAG = 10
) (
    input  wire clk,
    input  wire rst,
    input  wire in_valid,
    input  wire [TAG-1:0] in_tag,
    input  wire signed [23:0] in_u, in_v, bias, vth,
    input  wire signed [21:0] q,
    input  wire [5:0] in_refractory, delay,
    input  wire [11:0] keep_u,
    input  wire [12:0] keep_v,
    input  wire signed [23:0] vmin, vmax,
    output wire valid,
    output wire [TAG-1:0] tag,
    output wire signed [23:0] u, v,
    output wire [5:0] refractory,
    output wire spike
);
    function [23:0] size(input [23:0] x);
        size = x[23] ? -x : x;
    endfunction
    function signed [24:0] signed_again(input negative, input [23:0] x);
        signed_again = negative ? -$signed({1'b0, x}) : $signed({1'b0, x});
    endfunction

    // Values that later stages need, carried along.
    localparam CARRIED = TAG + 24 + 6 + 6;
    reg [CARRIED-1:0] carried1, carried2, carried3, carried4, carried5;
    reg [4:0] valids;
    always @(posedge clk) begin
        carried1 <= {in_tag, vth, delay, in_refractory};
        carried2 <= carried1; carried3 <= carried2; carried4 <= carried3; carried5 <= carried4;
        valids <= rst ? 5'd0 : {valids[3:0], in_valid};
    end

    reg [23:0] size_u, size_v;
    reg [11:0] keep_u1;
    reg [12:0] keep_v1;
    reg negative_u1, negative_v1, negative_u2, negative_v2;
    reg signed [23:0] bias1, bias2, bias3;
    reg signed [21:0] q1, q2;
    reg [35:0] product_u;
    reg [36:0] product_v;
    reg signed [23:0] u3, u4, u5, v5;
    reg signed [24:0] left3;
    reg signed [25:0] v4;
    wire signed [23:0] total = u3 + bias3;
    always @(posedge clk) begin
        size_u <= size(in_u); negative_u1 <= in_u[23]; keep_u1 <= keep_u;
        size_v <= size(in_v); negative_v1 <= in_v[23]; keep_v1 <= keep_v;
        q1 <= q; bias1 <= bias;

        product_u <= size_u * keep_u1; negative_u2 <= negative_u1;
        product_v <= size_v * keep_v1; negative_v2 <= negative_v1;
        q2 <= q1; bias2 <= bias1;

        u3 <= signed_again(negative_u2, product_u[35:12]) + q2;
        left3 <= signed_again(negative_v2, product_v[35:12]);
        bias3 <= bias2;

        v4 <= left3 + total; u4 <= u3;

        v5 <= carried4[5:0] != 0 ? 24'sd0 : v4 > vmax ? vmax : v4 < vmin ? vmin : v4[23:0];
        u5 <= u4;
    end

    wire signed [23:0] vth5 = carried5[35:12];
    wire [5:0] left = spike ? carried5[11:6] : carried5[5:0];
    assign valid = valids[4];
    assign tag = carried5[CARRIED-1:36];
    assign spike = v5 > vth5;
    assign u = u5;
    assign v = spike ? 24'sd0 : v5;
    assign refractory = left == 0 ? 6'd0 : left - 6'd1;
endmodule
