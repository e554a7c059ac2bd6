#include "core/interfaces/filter.h"

namespace strobe {

void Filter::sampleLanes(const V2Lanes& u, int n, V2Lanes& offset, float* weight) const {
    for (int i = 0; i < n; ++i) {
        const Sample s = sample(u.at(i));
        offset.set(i, s.offset);
        weight[i] = s.weight;
    }
}

} // namespace strobe
