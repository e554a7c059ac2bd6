// "disk": a disk, ring or sector at a height above the xy plane; its normal is +z.
#pragma once

#include "core/interfaces/shape.h"
#include "core/params/plugin.h"

namespace strobe {

/// The table row of the disk.
Plugin<Shape> diskPlugin();

} // namespace strobe
