#include "core/film.h"

namespace strobe {

void Film::write(const std::filesystem::path& path, const Metadata& metadata) const {
    const std::string extension = path.extension().string();
    if (extension == ".exr") {
        const float* data = &m_image.pixels[0].x;
        writeExr(path, m_window, m_fullWidth, m_fullHeight,
                 {{"R", data, 3}, {"G", data + 1, 3}, {"B", data + 2, 3}}, metadata);
    } else if (extension == ".png") {
        writePng(path, m_image, metadata);
    } else {
        throw Error("cannot write \"" + path.string() + "\": the name must end in .exr or .png",
                    ErrorKind::Usage);
    }
}

} // namespace strobe
