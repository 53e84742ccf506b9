// Appended to shim.cpp in libraries whose registers and memories can be changed from outside (sim/src/cosim/verilator.rs).
#include "verilated_syms.h"

extern "C" {

// Flips one bit of one word of a register or memory; returns 0 if there is no such bit. Dependent signals change at the
// first evaluation of the next cycle.
int32_t dermis_flip(void* handle, const char* scope, const char* signal, uint64_t word, uint64_t bit) {
    auto* model = static_cast<Model*>(handle);
    const VerilatedScope* const found = model->context.scopeFind(scope);
    const VerilatedVar* const var = found ? found->varFind(signal) : nullptr;
    if (!var) return 0;
    const uint64_t byte = word * var->entSize() + bit / 8;
    if (bit / 8 >= var->entSize() || byte >= var->totalSize()) return 0;
    static_cast<uint8_t*>(var->datap())[byte] ^= uint8_t(1u << (bit % 8));
    return 1;
}

}  // extern "C"
