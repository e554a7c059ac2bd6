// The session library: renders scene files to image files and merges parts, without a command line and
// without a logger library. All functions throw Error.
#pragma once

#include "core/math/api.h"
#include "session/log.h"
#include "session/options.h"

#include <atomic>
#include <mutex>

namespace STROBE_API strobe {

/// How a render or a merge ended.
enum class Outcome {
    Finished,       ///< all outputs are complete
    InvalidSamples, ///< all outputs are complete, but there are invalid samples, and `strict` is set
    OutputFailed,   ///< a file could not be written under its name; the log names the copy in another folder
    Interrupted ///< RenderControl::stop ended the render early; images have the attribute strobe:unfinished
};

/// Lets any thread stop a render, or save its checkpoint.
class RenderControl {
  public:
    /// Ends the render early: after the first pass where there are passes, else within a batch of samples. A
    /// render with a checkpoint saves it. Does not end a render with ProgressiveOptions::reference and
    /// without a time limit or noise target.
    void stop() { m_isStopped.store(true, std::memory_order_relaxed); }
    bool isStopped() const { return m_isStopped.load(std::memory_order_relaxed); }

    /// Saves the checkpoint, in the calling thread. Does nothing while no render with a checkpoint runs.
    void saveCheckpoint() {
        const std::lock_guard lock(m_mutex);
        if (m_save)
            m_save();
    }
    /// For the session: the function that saveCheckpoint calls; empty: none. After the return, the previous
    /// function is not running.
    void setSaveFunction(std::function<void()> save) {
        const std::lock_guard lock(m_mutex);
        m_save = std::move(save);
    }
    /// Waits until no outputs are being written, and keeps the session from writing while the lock exists.
    std::unique_lock<std::mutex> lockWriting() { return std::unique_lock(m_writing); }

  private:
    std::mutex m_writing;
    std::atomic<bool> m_isStopped{false};
    std::mutex m_mutex;
    std::function<void()> m_save; ///< guarded by m_mutex
};

/// How a program follows and controls a render. All members may be empty.
struct RenderCallbacks {
    /// Receives the fraction done, in [0, 1]: 0 when the rendering of an image begins, then increasing
    /// values. Called by any thread, by one at a time.
    std::function<void(double)> onProgress;
    /// Called when the rendering of an image has ended, before the messages about it.
    std::function<void()> onRendered;
    RenderControl* control = nullptr; ///< outlives the render
};

/// Parses and builds the scene, renders it, and writes the outputs: one image, or all frames of
/// `options.sequence` that are not finished. A file that cannot be written is saved in another folder (see
/// FallbackWriter); a sequence ends there.
Outcome renderScene(const RenderOptions& options, const Log& log, const RenderCallbacks& callbacks = {});

/// A pixel, or one of its visibility samples.
struct PixelQuery {
    V2i pixel;                      ///< in the full frame
    std::optional<uint32_t> sample; ///< number in the pixel; none: the pixel
};

struct PixelResult {
    Rgb value; ///< mean of the samples weighted by the filter; of one sample: its radiance, unweighted
    uint64_t invalidSamples; ///< of the pixel
};

/// Renders one pixel and writes no file. `options` must satisfy checkPixelOptions.
PixelResult renderPixel(const RenderOptions& options, const PixelQuery& query, const Log& log);

/// Reads and merges the parts, and writes the outputs. Warns of missing samples, and of images that are
/// smaller than the frame.
Outcome mergeParts(const MergeOptions& options, const Log& log);

} // namespace strobe
