// Color spaces and what displays show: the one file that knows OpenColorIO.
#pragma once

#include "core/math/math.h"
#include "core/util/error.h"

#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace strobe {

/// The space that scenes are rendered in: linear light, Rec. 709 primaries, D65; by the name that OpenColorIO
/// configs give it.
inline constexpr const char* kWorkingSpace = "lin_rec709";

/// Changes colors in place; may be called by several threads at once.
using ColorTransform = std::function<void(std::span<Rgb>)>;

/// The sRGB transfer function, linear [0,1] to encoded [0,1], and back.
float encodeSrgb(float linear);
float decodeSrgb(float encoded);

/// What of a picture a display shows. Empty names: what the config has as its first.
struct ViewSettings {
    std::string display, view, look;
    bool isDefault() const { return display.empty() && view.empty() && look.empty(); }
};

/// An OpenColorIO config: a file, or a small one of our own. It is read when it is first needed; all is
/// thread-safe. What cannot be read, or a name that is not in it, is an Error of kind Usage, or of kind Scene
/// when there is a location, and lists the names that are.
class ColorConfig {
  public:
    /// `file` as $OCIO has it; empty: our own.
    explicit ColorConfig(std::string file = {});
    ~ColorConfig();
    ColorConfig(const ColorConfig&) = delete;
    ColorConfig& operator=(const ColorConfig&) = delete;

    /// What the config calls the working space.
    std::string workingSpace() const;
    /// Colors of the working space to what a display shows, 0 to 1 where it can show them.
    ColorTransform view(const ViewSettings& settings) const;
    /// Colors of `space` (a name, another name, or a role) to those of the working space; empty when that
    /// changes nothing, as with data.
    ColorTransform toWorking(const std::string& space, const Location& where) const;
    /// The space that the config's rules give to a file of this name; empty when only the rule for all others
    /// does.
    std::string spaceOfFile(const std::filesystem::path& path, const Location& where) const;

  private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
};

/// The text of our own config.
const char* builtinColorConfig();

} // namespace strobe
