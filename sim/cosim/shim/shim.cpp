// C entry points of a verilated bench, loaded by sim/src/cosim/verilator.rs.
//
// The generated module `bench` packs every pin into two vectors (layout: sim/src/cosim/bench.rs), so this
// file is the same for every design:
//   in  [63:0]       rst, s_axis_*, m_axis_tready
//   out [32*N-1:0]   s_axis_tready, m_axis_*, taps; N >= 4, hence always an array of 32-bit words
#include "Vbench.h"
#include "verilated.h"

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

namespace {

// Folder of the memory files while a model starts; each thread starts one model at a time.
thread_local std::string memory_folder;

struct Model {
    VerilatedContext context;
    std::unique_ptr<Vbench> bench;
};

}  // namespace

extern "C" {

// The link wraps `fopen`: $readmemh names its files without a folder, and this process must not
// change its working directory under other threads.
FILE* __real_fopen(const char* path, const char* mode);
FILE* __wrap_fopen(const char* path, const char* mode) {
    if (memory_folder.empty() || path[0] == '/') return __real_fopen(path, mode);
    return __real_fopen((memory_folder + "/" + path).c_str(), mode);
}

// Bytes of `out`; the caller checks them against its own layout.
uint32_t dermis_out_bytes() { return sizeof(Vbench::out); }

// A model after its initial blocks have run (the memory files are read here). Registers without
// an initial value start random, from `seed`, so that a missing reset shows.
void* dermis_new(const char* folder, int32_t seed) {
    auto* model = new Model;
    model->context.randReset(2);
    model->context.randSeed(seed);
    model->bench.reset(new Vbench{&model->context, "bench"});
    memory_folder = folder;
    model->bench->clk = 0;
    model->bench->in = 0;
    model->bench->eval();
    memory_folder.clear();
    return model;
}

// One clock cycle: settle with clk low, sample, then the rising edge.
void dermis_cycle(void* handle, uint64_t in, uint32_t* out) {
    Vbench& bench = *static_cast<Model*>(handle)->bench;
    bench.clk = 0;
    bench.in = in;
    bench.eval();
    std::memcpy(out, &bench.out, sizeof(Vbench::out));
    bench.clk = 1;
    bench.eval();
}

void dermis_free(void* handle) {
    auto* model = static_cast<Model*>(handle);
    model->bench->final();
    delete model;
}

}  // extern "C"
