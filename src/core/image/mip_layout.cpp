#include "core/image/mip_layout.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace strobe {

void MipLayout::add(int width, int height, bool isTiled) {
    constexpr int kTile = 64;
    if (!isTiled) {
        levels.push_back({width, height, int32_t(texels), kTile * width, kTile, width});
        texels += size_t(width) * size_t(height);
        return;
    }
    const int across = (width + kTile - 1) / kTile, down = (height + kTile - 1) / kTile;
    levels.push_back({width, height, int32_t(texels), across * kTile * kTile, kTile * kTile, kTile});
    texels += size_t(across) * size_t(down) * kTile * kTile;
}

MipLayout MipLayout::halving(int width, int height) {
    MipLayout layout;
    for (;; width = std::max(width / 2, 1), height = std::max(height / 2, 1)) {
        layout.add(width, height, width >= 64 && height >= 64);
        if (width == 1 && height == 1)
            return layout;
    }
}

namespace {

/// A level while the next one is computed: as codes, row by row, or as linear floats.
struct LevelRows {
    int width, height, channels;
    const TexelCodec* codec; ///< null: `floats` has the values
    std::vector<std::byte> codes{};
    std::vector<float> floats{};

    size_t rowLength() const { return size_t(width) * size_t(channels); }
    /// Adds the values of row y, times `weight`, to `sums`.
    void addRow(int y, float weight, std::vector<float>& sums) const {
        const size_t first = size_t(y) * rowLength();
        if (codec)
            return codec->addDecoded(codes.data(), first, sums.size(), weight, sums.data());
        for (size_t i = 0; i < sums.size(); ++i)
            sums[i] += weight * floats[first + i];
    }
};

/// The pixels of a level that a pixel of the next level covers along one axis, and their weights.
struct Coverage {
    int first = 0, count = 0;
    float weights[3]{};

    /// Pixel i of `n`, over `source` pixels; 1 <= source / n <= 3.
    Coverage(int i, int n, int source) {
        const double begin = double(i) * source / n, end = double(i + 1) * source / n;
        first = int(begin);
        for (int x = first; x < source && x < end && count < 3; ++x)
            weights[count++] =
                float((std::min(double(x + 1), end) - std::max(double(x), begin)) / (end - begin));
    }
};

/// Returns the next level: means over the area of each of its pixels.
LevelRows halved(const LevelRows& level, int width, int height) {
    LevelRows out{width, height, level.channels, nullptr};
    const auto channels = size_t(level.channels);
    out.floats.resize(size_t(width) * size_t(height) * channels);
    std::vector<Coverage> columns;
    for (int x = 0; x < width; ++x)
        columns.emplace_back(x, width, level.width);
    std::vector<float> sums(level.rowLength());
    float* target = out.floats.data();
    for (int y = 0; y < height; ++y) {
        std::fill(sums.begin(), sums.end(), 0.f);
        const Coverage rows(y, height, level.height);
        for (int i = 0; i < rows.count; ++i)
            level.addRow(rows.first + i, rows.weights[i], sums);
        for (const Coverage& column : columns)
            for (size_t c = 0; c < channels; ++c) {
                float sum = 0;
                for (int i = 0; i < column.count; ++i)
                    sum += column.weights[i] * sums[size_t(column.first + i) * channels + c];
                *target++ = sum;
            }
    }
    return out;
}

void writeLevel(const LevelRows& level, const MipLayout::Level& place, const TexelCodec& codec,
                TexelMemory& texels) {
    const auto channels = size_t(level.channels);
    for (int y = 0; y < level.height; ++y)
        for (int x = 0; x < level.width; ++x) {
            const size_t to = size_t(place.index(x, y)) * channels;
            const size_t from = (size_t(y) * size_t(level.width) + size_t(x)) * channels;
            if (level.codec) {
                std::memcpy(texels.data() + to * codec.bytes(), level.codes.data() + from * codec.bytes(),
                            channels * codec.bytes());
                continue;
            }
            for (size_t c = 0; c < channels; ++c)
                codec.encode(level.floats[from + c], texels.data(), to + c);
        }
}

/// Decodes values that are stored as in a file.
void decode(const TexelSource& source, std::vector<float>& values) {
    const bool isFloat = source.file.stored == StoredType::Half || source.file.stored == StoredType::Float;
    if (!source.encoding.hasEffect(isFloat))
        return;
    if (source.encoding.kind != ColorEncoding::Space) {
        for (float& v : values)
            v = source.encoding.decode(v);
        return;
    }
    std::vector<Rgb> colors(values.size() / 3); // gray images are read as three channels
    std::memcpy(static_cast<void*>(colors.data()), values.data(), values.size() * sizeof(float));
    source.encoding.toWorking(colors);
    std::memcpy(values.data(), static_cast<const void*>(colors.data()), values.size() * sizeof(float));
}

/// Repeats the values of a gray image as three equal channels.
void repeatGray(std::vector<float>& values) {
    std::vector<float> repeated;
    repeated.reserve(3 * values.size());
    for (const float v : values)
        repeated.insert(repeated.end(), 3, v);
    values.swap(repeated);
}

/// Reads a level of the file. Returns false on failure.
bool readLevel(const TexelSource& source, int number, const TexelCodec& codec, LevelRows& level,
               std::string& error) {
    const int n = std::min(source.channels, source.file.channels - source.firstChannel);
    const int stored = n < source.channels ? 1 : n;
    const int end = source.firstChannel + stored;
    const size_t values = size_t(level.width) * size_t(level.height) * size_t(stored);
    if (codec.keeps(source.file.stored) && stored == source.channels) {
        level.codec = &codec;
        level.codes.resize(values * codec.bytes());
        return source.file.readLevel(number, source.firstChannel, end, source.file.stored, level.codes.data(),
                                     error);
    }
    level.floats.resize(values);
    if (!source.file.readLevel(number, source.firstChannel, end, StoredType::Float,
                               reinterpret_cast<std::byte*>(level.floats.data()), error))
        return false;
    if (stored < source.channels)
        repeatGray(level.floats);
    decode(source, level.floats);
    return true;
}

bool hasInvalid(const LevelRows& level, const TexelCodec& codec) {
    if (codec.kind() == TexelCodec::Byte || codec.kind() == TexelCodec::Word)
        return false;
    const size_t count = level.rowLength() * size_t(level.height);
    for (size_t i = 0; i < count; ++i)
        if (!std::isfinite(level.codec ? codec.decode(level.codes.data(), i) : level.floats[i]))
            return true;
    return false;
}

} // namespace

bool writeMipLevels(const TexelSource& source, const MipLayout& layout, const TexelCodec& codec,
                    TexelMemory& texels, bool& hasInvalidValues, std::string& error) {
    LevelRows level{};
    for (size_t i = 0; i < layout.levels.size(); ++i) {
        const MipLayout::Level& place = layout.levels[i];
        if (source.file.levelSize(int(i)) == V2i(place.width, place.height)) {
            level = {place.width, place.height, source.channels, nullptr};
            if (!readLevel(source, int(i), codec, level, error))
                return false;
        } else {
            level = halved(level, place.width, place.height);
        }
        if (i == 0)
            hasInvalidValues = hasInvalid(level, codec);
        writeLevel(level, place, codec, texels);
    }
    return true;
}

} // namespace strobe
