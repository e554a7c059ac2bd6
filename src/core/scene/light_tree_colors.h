// Classes of color of the emitters of a light tree.
#pragma once

#include "core/scene/light_tree_builder.h"

namespace strobe {

/// Divides emitters into at most `maxCount` classes whose colors vary little. Orders them by class, writes
/// the classes and returns their number. An emitter counts with its intensity. Emitters of similar colors are
/// not divided.
int divideByColor(std::span<TreeEmitter> emitters, int maxCount, std::span<TreeEmitter>* classes);

} // namespace strobe
