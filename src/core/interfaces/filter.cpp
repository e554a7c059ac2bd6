#include "core/interfaces/filter.h"

namespace strobe {

void Filter::sampleSoA(const V2SoA& u, int n, V2SoA& offset, float* weight) const {
    for (int i = 0; i < n; ++i) {
        const Sample s = sample(u.at(i));
        offset.set(i, s.offset);
        weight[i] = s.weight;
    }
}

} // namespace strobe
