// Sends the bytes of a file over a serial line to a board, and writes what it answers to another.
// A pause follows each byte of 255 in the file `pauses`, which has as many bytes.
`timescale 1ns/1ns
module bench;
    reg clk = 0, rx = 1;
    wire tx;
    board board (.clk(clk), .rx(rx), .tx(tx));
    always #1 clk = !clk;

    integer sent, pauses, answered, bits, octet, pause;
    localparam BIT = 2 * `BAUD_CYCLES;
    initial begin
        sent = $fopen("sent", "rb"); pauses = $fopen("pauses", "rb");
        #100;
        octet = $fgetc(sent);
        while (octet >= 0) begin
            rx = 0; #BIT;
            for (bits = 0; bits < 8; bits = bits + 1) begin rx = octet[bits]; #BIT; end
            rx = 1; #BIT;
            pause = $fgetc(pauses);
            #(20 * pause * BIT);
            octet = $fgetc(sent);
        end
        $fclose(answered);
        $finish;
    end

    integer place;
    reg [7:0] got;
    initial begin
        answered = $fopen("answered", "wb");
        #50;
        forever begin
            @(negedge tx) #(BIT + BIT / 2);
            for (place = 0; place < 8; place = place + 1) begin got[place] = tx; #BIT; end
            $fwrite(answered, "%c", got);
        end
    end
endmodule
