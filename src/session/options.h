// The options of renders and merges, and their check.
#pragma once

#include "core/film/film.h"
#include "core/math/api.h"
#include "core/render/integrator.h"
#include "core/util/resource_policy.h"
#include "display/display_server.h"
#include "loader/build/builder.h"

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace STROBE_API strobe {

/// How pixels become image files.
struct ImageOptions {
    ViewSettings view;             ///< of PNG, JPEG and TIFF
    std::optional<float> exposure; ///< of PNG, JPEG and TIFF, in stops; none: 0, or automatic
    ExrSettings exr;
    /// Has the views of PNG, JPEG and TIFF, and names the working space in EXRs.
    std::shared_ptr<const ColorConfig> color = std::make_shared<const ColorConfig>();
};

/// The files that a render writes. Empty paths: none.
struct OutputOptions {
    /// Files of the formats of imageFormatOf, or .part. Empty: the output name of the scene, or else the stem
    /// of the first scene file and .exr, in the current folder.
    std::vector<std::filesystem::path> images;
    bool noImage = false;     ///< `images` is empty, and no image is written
    bool makeFolders = false; ///< creates the folders of outputs that do not exist
    ImageOptions format;
    std::vector<Aov> aovs;         ///< layers of the EXRs
    int cryptomatteEntries = 6;    ///< names per pixel in Cryptomatte layers
    std::filesystem::path stats;   ///< JSON
    std::filesystem::path heatmap; ///< PNG of heatmapAov in false color
    Aov heatmapAov = Aov::Shades;
    std::filesystem::path samples; ///< CSV of every visibility sample
};

/// When a render ends, and what it writes or shows until then. Intervals and limits are in seconds; 0: none.
struct ProgressiveOptions {
    double timeLimit = 0;
    /// Time from which timeLimit counts. None: the call of renderScene. In a sequence each frame has the
    /// limit, from the end of the previous frame.
    std::optional<std::chrono::steady_clock::time_point> start;
    double noiseTarget = 0;           ///< NoiseEstimate::level to reach; 0: none
    std::filesystem::path reference;  ///< image to compute errors against while rendering
    std::filesystem::path errorCurve; ///< CSV of these errors
    double writeInterval = 0;         ///< between writes of the unfinished image to the outputs
    double checkpointInterval = 0;    ///< between writes of the checkpoint
    bool resume = false;              ///< continues from the checkpoint, if there is one
    std::optional<ViewerAddress> viewer;

    /// Whether the image is the mean of passes, rendered until the time limit or noise target.
    bool takesPasses() const { return timeLimit > 0 || noiseTarget > 0; }
};

/// Frames of an animation. The shutter of frame f is open from (f + shutterOpen) / fps to (f + shutterClose)
/// / fps in scene time.
struct SequenceOptions {
    std::vector<int> frames{0}; ///< in the order of rendering
    double fps = 24, shutterOpen = 0, shutterClose = 0.5;
    bool overwrite = false; ///< renders finished frames again
    /// Text of all options that affect the image. Frames with a different text are not finished.
    std::string settings;
};

/// One of `count` slices of a frame: see InterleavedTiles.
struct FrameSlice {
    uint32_t number = 0; ///< less than `count`
    uint32_t count = 1;
};

struct RenderOptions {
    std::vector<std::filesystem::path> scenes; ///< read one after another, as if they were one file
    BuildOptions build;
    ResourcePolicy::Settings resources; ///< limits of the scene
    OutputOptions output;
    ProgressiveOptions progressive;
    std::optional<SequenceOptions> sequence;
    std::optional<SampleSlice> sampleRange; ///< of each pixel; none: all
    std::optional<FrameSlice> slice;        ///< the pixels to render; none: all
    uint64_t seed = 0;
    float clamp = 0; ///< see RenderSettings::clamp
    /// Invalid samples are Outcome::InvalidSamples, and files that do not conform to glTF are errors.
    bool strict = false;
    bool dryRun = false; ///< loads and checks the scene, and estimates the time; writes `output.stats` only
    /// Statistics (OutputOptions::stats) of a render whose version and scene this one must have; empty: none.
    std::filesystem::path expected;
    std::string commandLine; ///< for the metadata of images; may be empty
    int threads = 0;         ///< 0: one per core
    int tileSize = 32;       ///< pixels; does not change the image
};

struct MergeOptions {
    std::vector<std::filesystem::path> parts;
    std::vector<std::filesystem::path> images; ///< see OutputOptions
    bool makeFolders = false;                  ///< see OutputOptions
    ImageOptions format;
    bool strict = false;       ///< see RenderOptions
    bool allowMissing = false; ///< parts that do not exist, and samples that the parts lack, are warnings
    std::shared_ptr<const PluginLibraries> plugins = std::make_shared<const PluginLibraries>();
};

/// Throws Error of kind Usage if a value is out of range, or if options exclude or require each other.
/// Messages name options as the command line does.
void checkOptions(const RenderOptions& options);
/// As checkOptions, and throws for options that have no effect on renderPixel.
void checkPixelOptions(const RenderOptions& options);
void checkOptions(const MergeOptions& options);

} // namespace strobe
