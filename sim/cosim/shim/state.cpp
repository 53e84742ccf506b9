// Appended to shim.cpp in libraries whose registers and memories are read or changed from outside
// (sim/src/cosim/verilator.rs).
#include "verilated_syms.h"

extern "C" {

// Where the words of a register or memory lie, in order, until the model is freed; null if there is no such signal.
// Dependent signals change at the first evaluation of the next cycle.
void* dermis_words(void* handle, const char* scope, const char* signal, uint64_t* word_bytes, uint64_t* bytes) {
    auto* model = static_cast<Model*>(handle);
    const VerilatedScope* const found = model->context.scopeFind(scope);
    const VerilatedVar* const var = found ? found->varFind(signal) : nullptr;
    if (!var) return nullptr;
    *word_bytes = var->entSize();
    *bytes = var->totalSize();
    return var->datap();
}

}  // extern "C"
