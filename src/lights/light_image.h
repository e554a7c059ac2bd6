// Images of lights: reading and interpolation.
#pragma once

#include "core/image/image.h"
#include "core/image/mip_map.h"
#include "core/params/plugin.h"

namespace strobe {

/// Reads the image file that the parameter names. 8- and 16-bit files are decoded from sRGB, in
/// files of pbrt-v2 and v3 as linear, unless the OpenColorIO config has a rule for them. Throws the located
/// Errors of readImage.
Image readLightImage(const ParamSet& params, const ParamDef<FilePath>& def, const BuildContext& context);

/// Returns the bilinearly interpolated pixel at `st` in [0,1]²; (0,0) is the top left corner.
Rgb bilinear(const Image& image, const V2f& st, Wrap wrap);

} // namespace strobe
