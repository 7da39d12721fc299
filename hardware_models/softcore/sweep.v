// The compartments of a core: their memory, and the sweep that updates each of them once a step.
//
//     constants  {sends, axon[11:0], threshold[4:0], profile[4:0], bias[23:0]}
//     profile    {delay[5:0], keep_v[12:0], keep_u[11:0]}
//     state      {refractory[5:0], v[23:0], u[23:0]}, and a bit for its spike
//
// Decays, delay and thresholds are shared by compartments, as on Loihi. A sweep with `clear` writes
// zeros in place of the new state; two of them clear both banks of sums.
module sweep #(
    parameter LOG_COMPARTMENTS = 10,
    parameter WIDTH = 22,                            // bits of a sum, in units of 2^(22 - WIDTH)
    parameter AXON = 12
) (
    input  wire clk,
    input  wire rst,
    input  wire go,
    input  wire clear,
    output reg  busy,
    output wire [LOG_COMPARTMENTS-1:0] swept,
    input  wire signed [WIDTH-1:0] q,                // of the compartment swept a cycle before
    output wire spike,
    output wire [AXON-1:0] axon,
    output wire idle,
    input  wire [LOG_COMPARTMENTS-1:0] read_at,      // read between steps, a cycle later
    output wire signed [23:0] read_u, read_v,
    output reg  read_spike,
    input  wire write,
    input  wire [2:0] select,
    input  wire [LOG_COMPARTMENTS-1:0] write_at,
    input  wire [47:0] in
);
    localparam LAST = LOG_COMPARTMENTS - 1, N = 1 << LOG_COMPARTMENTS, TAG = LAST + 1 + 1 + AXON;
    reg [46:0] constants [0:N-1];
    reg [53:0] state [0:N-1];
    reg spiked [0:N-1];
    reg [30:0] profiles [0:31];
    reg [23:0] thresholds [0:31];
    reg [LAST+1:0] size;
    reg signed [23:0] vmin, vmax;
    always @(posedge clk) if (write) case (select)
        3'd0: constants[write_at] <= in[46:0];
        3'd3: profiles[write_at[4:0]] <= in[30:0];
        3'd4: thresholds[write_at[4:0]] <= in[23:0];
        3'd5: size <= in[LAST+1:0];
        3'd6: {vmin, vmax} <= in;
        default: ;
    endcase

    reg [LAST+1:0] at;
    reg clearing;
    assign swept = at[LAST:0];
    always @(posedge clk)
        if (rst) busy <= 0;
        else if (go) begin
            busy <= size != 0; at <= 0; clearing <= clear;
        end else if (busy) begin
            at <= at + 1'b1;
            busy <= at + 1'b1 != size;
        end

    // The words read of a compartment, then its profile, then the pipeline.
    wire [LAST:0] place = busy ? swept : read_at;
    reg valid1, valid2;
    reg [LAST:0] index1, index2;
    reg [46:0] constants1;
    reg [53:0] state1, state2;
    reg [30:0] profile2;
    reg [23:0] bias2, vth2;
    reg [12:0] sends2;
    reg signed [21:0] q2;
    always @(posedge clk) begin
        constants1 <= constants[place]; state1 <= state[place]; read_spike <= spiked[place];
        index1 <= swept; index2 <= index1;
        valid1 <= busy & !rst; valid2 <= valid1 & !rst;
        profile2 <= profiles[constants1[28:24]]; vth2 <= thresholds[constants1[33:29]];
        {sends2, bias2, state2} <= {constants1[46:34], constants1[23:0], state1};
        q2 <= {q, {(22 - WIDTH){1'b0}}};
    end
    assign {read_v, read_u} = state1[47:0];

    wire done, fires, sends;
    wire [LAST:0] index;
    wire [23:0] u, v;
    wire [5:0] refractory;
    neuron #(.TAG(TAG)) neuron (
        .clk(clk), .rst(rst), .in_valid(valid2), .in_tag({index2, sends2}),
        .in_u(state2[23:0]), .in_v(state2[47:24]), .in_refractory(state2[53:48]),
        .bias(bias2), .vth(vth2), .q(q2), .delay(profile2[30:25]), .keep_v(profile2[24:12]),
        .keep_u(profile2[11:0]), .vmin(vmin), .vmax(vmax), .valid(done),
        .tag({index, sends, axon}), .u(u), .v(v), .refractory(refractory), .spike(fires));
    assign spike = done & fires & sends & !clearing;

    reg under_way;
    always @(posedge clk) begin
        if (done) begin
            state[index] <= clearing ? 54'd0 : {refractory, v, u};
            spiked[index] <= fires & !clearing;
        end
        if (rst) under_way <= 0;
        else if (go) under_way <= size != 0;
        else if (done & index + 1'b1 == size) under_way <= 0;
    end
    assign idle = !under_way;

`ifdef OBSERVED
    // The simulation sees every state that is written.
    parameter NUMBER = 0;
    import "DPI-C" function void softcore_state(
        input int core, input int index, input int u, input int v, input int q,
        input int refractory, input int spike);
    reg signed [21:0] carried [0:4];
    always @(posedge clk) begin
        carried[0] <= q2;
        for (integer i = 1; i < 5; i = i + 1) carried[i] <= carried[i - 1];
        if (done & !clearing)
            softcore_state(NUMBER, 32'(index), 32'($signed(u)), 32'($signed(v)), 32'(carried[4]),
                           32'(refractory), 32'(fires));
    end
`endif
endmodule
