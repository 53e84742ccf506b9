// Plays Ethernet frames to the gateware `network` at the boundary of its PHY, a byte per cycle of 125 MHz, and prints the frames
// that come back. Each clock has its own period and phase.
//
// usage: Vnetwork PLAY SYS_HALF_PERIOD_PS TAIL_CYCLES
//
// A line of PLAY is `ANSWERS GAP BYTES`: once ANSWERS frames have come back, and GAP cycles later, these bytes are received. With `-`
// lines come from standard input, as long as it is open: time stands still where nothing comes and nothing happens.
// Printed are `received TIME_PS` for the end of each frame that was played, `frame TIME_PS BYTES` for each that comes back, once all is
// played and TAIL_CYCLES are over the word of each counter as `counters WORD ...`, and `cycles COUNT`, those of the system's clock. A
// frame with a pause in it, or ANSWERS that do not come, end with code 1.
#include <poll.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "Vnetwork.h"
#include "verilated.h"

namespace {

// Half a period of 125 MHz, where the clocks of the PHY begin, and how long nothing may come back before it counts as a hang.
constexpr uint64_t ETH_HALF_PS = 4000, RX_PHASE_PS = 1300, TX_PHASE_PS = 2900, PATIENCE_CYCLES = 1'000'000;
// Between two frames Ethernet has at least the time of 12 bytes.
constexpr uint64_t GAP_CYCLES = 12;

struct Received {
    uint64_t answers, gap;
    std::vector<uint8_t> bytes;
};

void add_lines(std::istream &lines, std::vector<Received> &play) {
    uint64_t answers, gap;
    std::string digits;
    while (lines >> answers >> gap >> digits) {
        Received own{answers, gap, {}};
        for (size_t at = 0; at + 1 < digits.size(); at += 2) own.bytes.push_back(std::stoi(digits.substr(at, 2), nullptr, 16));
        play.push_back(own);
    }
}

// Lines of standard input, which are taken once they are whole.
class Live {
   public:
    explicit Live(bool is_open) : is_open(is_open) {}

    bool is_open;

    // Takes what has come; waits for it if asked to.
    void take(std::vector<Received> &play, bool waits) {
        pollfd input{STDIN_FILENO, POLLIN, 0};
        if (!is_open || poll(&input, 1, waits ? -1 : 0) <= 0) return;
        char bytes[4096];
        const ssize_t count = read(STDIN_FILENO, bytes, sizeof bytes);
        is_open = count > 0;
        text.append(bytes, count > 0 ? count : 0);
        const size_t end = text.rfind('\n');
        if (end == std::string::npos) return;
        std::istringstream lines(text.substr(0, end));
        text.erase(0, end + 1);
        add_lines(lines, play);
    }

   private:
    std::string text;
};

}  // namespace

int main(int argc, char **argv) {
    if (argc != 4) {
        std::fprintf(stderr, "usage: %s PLAY SYS_HALF_PERIOD_PS TAIL_CYCLES\n", argv[0]);
        return 2;
    }
    std::vector<Received> play;
    Live live(std::string(argv[1]) == "-");
    const bool is_live = live.is_open;
    if (!is_live) {
        std::ifstream file(argv[1]);
        add_lines(file, play);
    }
    const uint64_t sys_half = std::strtoull(argv[2], nullptr, 10), tail = std::strtoull(argv[3], nullptr, 10);
    VerilatedContext context;
    Vnetwork dut(&context);
    uint64_t sys_at = sys_half, rx_at = RX_PHASE_PS, tx_at = TX_PHASE_PS, cycles = 0;
    uint64_t answers = 0, waited = 0, quiet = 0, played = 0, at = 0;
    std::vector<uint8_t> own;
    dut.sys_clk = dut.eth_rx_clk = dut.eth_tx_clk = 0;
    dut.rx_valid = dut.rx_data = dut.rx_last = 0;
    dut.rst = 1;
    while (live.is_open || played < play.size() || quiet < tail) {
        if (live.is_open) live.take(play, played == play.size() && quiet >= tail);
        const uint64_t now = sys_at < rx_at ? (sys_at < tx_at ? sys_at : tx_at) : (rx_at < tx_at ? rx_at : tx_at);
        if (now == sys_at) {
            sys_at += sys_half;
            dut.sys_clk = !dut.sys_clk;
            cycles += dut.sys_clk;
            if (cycles == 20) dut.rst = 0;
        }
        // Pins change and are read where the clock falls.
        if (now == rx_at) {
            rx_at += ETH_HALF_PS;
            dut.eth_rx_clk = !dut.eth_rx_clk;
            if (!dut.eth_rx_clk && !dut.rst) {
                ++quiet;
                if (at > 0 && at == play[played].bytes.size()) {
                    at = waited = quiet = 0;
                    ++played;
                    std::printf("received %llu\n", (unsigned long long)now);
                    dut.rx_valid = dut.rx_last = 0;
                } else if (played < play.size()) {
                    const auto &next = play[played];
                    if (at > 0 || (answers >= next.answers && waited++ >= next.gap + GAP_CYCLES)) {
                        dut.rx_valid = 1;
                        dut.rx_data = next.bytes[at++];
                        dut.rx_last = at == next.bytes.size();
                    } else if (quiet > PATIENCE_CYCLES && !is_live) {
                        std::printf("hang after %llu frames\n", (unsigned long long)answers);
                        return 1;
                    }
                }
            }
        }
        if (now == tx_at) {
            tx_at += ETH_HALF_PS;
            dut.eth_tx_clk = !dut.eth_tx_clk;
            if (!dut.eth_tx_clk && !dut.rst) {
                if (dut.tx_valid) {
                    own.push_back(dut.tx_data);
                    if (dut.tx_last) {
                        std::printf("frame %llu ", (unsigned long long)now);
                        for (auto byte : own) std::printf("%02x", byte);
                        std::printf("\n");
                        std::fflush(stdout);
                        own.clear();
                        ++answers;
                        quiet = 0;
                    }
                } else if (!own.empty()) {
                    std::printf("pause in frame %llu\n", (unsigned long long)answers);
                    return 1;
                }
            }
        }
        dut.eval();
    }
    std::printf("counters");
    for (size_t word = 0; word < sizeof dut.counters / 4; ++word) std::printf(" %u", dut.counters[word]);
    std::printf("\ncycles %llu\n", (unsigned long long)cycles);
    return 0;
}
