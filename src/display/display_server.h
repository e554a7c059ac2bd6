// The picture in tev, while it is rendered.
#pragma once

#include "display/live_film.h"

#include <functional>
#include <memory>
#include <string>

namespace strobe {

/// Where a viewer listens.
struct ViewerAddress {
    std::string host, port;
    /// "host:port", "[IPv6]:port", or without a port: tev's own, 14158. None: not an address.
    static std::optional<ViewerAddress> parse(const std::string& text);
    std::string text() const { return host + ":" + port; }
};

/// Sends what changes in a film to tev (https://github.com/Tom94/tev) through its TCP protocol: one image,
/// named `name`, with channels R, G and B, updated piece by piece. A thread of its own does it: a viewer that
/// is slow misses updates, one that goes away, or is not there yet, is looked for again every few seconds;
/// `warn` (called from that thread) hears of it once. The render never waits.
class DisplayServer {
  public:
    /// `farewell`: how long the end may take, to send what is left.
    DisplayServer(const ViewerAddress& address, const std::string& name, std::shared_ptr<LiveFilm> film,
                  std::chrono::milliseconds farewell, std::function<void(const std::string&)> warn);
    ~DisplayServer();
    DisplayServer(const DisplayServer&) = delete;
    DisplayServer& operator=(const DisplayServer&) = delete;

  private:
    struct State;
    std::chrono::milliseconds m_farewell;
    std::shared_ptr<State> m_state;
};

} // namespace strobe
