// A board in Verilator with the host's end of its link, for backends/softcore/line.py.
#include <cstdint>
#include <deque>
#include <memory>

#include "Vboard.h"
#include "verilated.h"

namespace {

// The other end of a serial line, whose bits take `bit` cycles of the board's clock.
class Serial {
  public:
    explicit Serial(double bit) : bit_(bit) {}

    void before(Vboard& board, std::deque<uint8_t>& sent) {
        if (out_left_ == 0 && !sent.empty()) {
            out_ = sent.front() << 1 | 0x200;    // start bit, 8 bits, stop bit
            sent.pop_front();
            out_left_ = 10;
            out_time_ = 0;
        }
        board.rx = out_left_ > 0 ? out_ & 1 : 1;
        if (out_left_ > 0 && ++out_time_ >= bit_) {
            out_time_ -= bit_;
            out_ >>= 1;
            --out_left_;
        }
    }
    void after(const Vboard& board, std::deque<uint8_t>& answer) {
        if (in_left_ == 0) {
            if (board.tx) return;
            in_left_ = 9;                        // 8 bits and the stop bit, each in its middle
            in_wait_ = 1.5 * bit_;
        } else if (--in_wait_ <= 0) {
            in_wait_ += bit_;
            if (--in_left_ == 0) answer.push_back(in_);
            else in_ = in_ >> 1 | board.tx << 7;
        }
    }

  private:
    const double bit_;
    uint32_t out_ = 0, out_left_ = 0, in_left_ = 0;
    double out_time_ = 0, in_wait_ = 0;
    uint8_t in_ = 0;
};

// FTDI's chip in "245 asynchronous FIFO" mode, its times in ns; `period` is that of the clock.
class Fifo {
  public:
    explicit Fifo(double period) : period_(period) {}

    void before(Vboard& board, std::deque<uint8_t>& sent) {
        now_ += period_;
        board.rxf_n = sent.empty() || now_ < filled_again_;
        board.txe_n = now_ < room_again_;
        // Data is there 14 ns after RD# falls; nothing sensible is before.
        board.data_in = !rd_n_ && now_ - rd_fell_ >= 14 && !sent.empty() ? sent.front() : 0xEE;
    }
    // Returns false where the board breaks a rule of the chip's data sheet.
    bool after(const Vboard& board, std::deque<uint8_t>& sent, std::deque<uint8_t>& answer) {
        bool good = board.rd_n || board.wr_n;
        if (rd_n_ && !board.rd_n) {
            good &= !board.rxf_n && !board.drive;
            rd_fell_ = now_;
        } else if (!rd_n_ && board.rd_n) {
            good &= now_ - rd_fell_ >= 30;
            sent.pop_front();
            filled_again_ = now_ + 14 + 49;
        }
        if (wr_n_ && !board.wr_n) {
            good &= !board.txe_n && drove_ && data_ == board.data_out;
            wr_fell_ = now_;
            answer.push_back(board.data_out);
            // Full now and then, for long.
            room_again_ = answer.size() % 7 == 0 ? now_ + 2000 : now_ + 14 + 49;
        } else if (!wr_n_ && board.wr_n) {
            good &= now_ - wr_fell_ >= 30;
        }
        if (!wr_n_) good &= board.drive && data_ == board.data_out;
        rd_n_ = board.rd_n;
        wr_n_ = board.wr_n;
        drove_ = board.drive;
        data_ = board.data_out;
        return good;
    }

  private:
    const double period_;
    double now_ = 0, rd_fell_ = 0, wr_fell_ = 0, filled_again_ = 0, room_again_ = 0;
    bool rd_n_ = true, wr_n_ = true, drove_ = false;
    uint8_t data_ = 0;
};

struct Board {
    VerilatedContext context;
    Vboard board{&context};
    Serial serial;
    Fifo fifo;
    const bool is_fifo;
    std::deque<uint8_t> sent, answer;

    Board(double bit, double period) : serial(bit), fifo(period), is_fifo(bit == 0) {}

    bool tick() {
        board.clk = 0;
        if (is_fifo) fifo.before(board, sent);
        else serial.before(board, sent);
        board.eval();
        board.clk = 1;
        board.eval();
        if (is_fifo) return fifo.after(board, sent, answer);
        serial.after(board, answer);
        return true;
    }
};

}  // namespace

extern "C" {

// bit: cycles of a bit of the serial line, 0 for a FIFO; period: ns of a cycle.
Board* board_open(double bit, double period) {
    auto opened = std::make_unique<Board>(bit, period);
    opened->board.rxf_n = opened->board.txe_n = opened->board.rx = 1;
    opened->board.rst = 1;
    for (int i = 0; i < 8; ++i) opened->tick();
    opened->board.rst = 0;
    for (int i = 0; i < 8; ++i) opened->tick();
    return opened.release();
}

void board_close(Board* board) { delete board; }

// Stays quiet, sends bytes, and drops what is answered until all has been quiet for as long. Returns
// the cycles that this took, -1 where they are more than `most`, -2 where the board breaks a rule of
// FTDI's chip.
int64_t board_restart(Board* board, const uint8_t* sent, int n_sent, int64_t quiet, int64_t most) {
    for (int64_t i = 0; i < quiet; ++i)
        if (!board->tick()) return -2;
    board->sent.insert(board->sent.end(), sent, sent + n_sent);
    size_t had = board->answer.size();
    int64_t left = quiet;
    for (int64_t cycle = quiet + 1; cycle <= most; ++cycle) {
        if (!board->tick()) return -2;
        if (!board->sent.empty() || board->answer.size() != had) left = quiet;
        had = board->answer.size();
        if (--left > 0) continue;
        board->answer.clear();
        return cycle;
    }
    return -1;
}

// Sends bytes, and reads n bytes. Returns the cycles from the first byte to the last, -1 where they take
// longer than `most`, -2 where the board breaks a rule of FTDI's chip.
int64_t board_exchange(Board* board, const uint8_t* sent, int n_sent, uint8_t* answer, int n,
                       int64_t most) {
    board->sent.insert(board->sent.end(), sent, sent + n_sent);
    for (int64_t cycle = 1; cycle <= most; ++cycle) {
        if (!board->tick()) return -2;
        if (!board->sent.empty() || static_cast<int>(board->answer.size()) < n) continue;
        for (int i = 0; i < n; ++i) {
            answer[i] = board->answer.front();
            board->answer.pop_front();
        }
        return cycle;
    }
    return -1;
}
}
