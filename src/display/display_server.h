// Shows the image in tev while it is rendered.
#pragma once

#include "core/math/api.h"
#include "display/live_film.h"

#include <functional>
#include <memory>
#include <string>

namespace STROBE_API strobe {

/// The address at which a viewer listens.
struct ViewerAddress {
    std::string host, port;
    /// Parses "host:port" or "[IPv6]:port"; without a port it is 14158, the default of tev. Returns none if
    /// the text is not an address.
    static std::optional<ViewerAddress> parse(const std::string& text);
    std::string text() const { return host + ":" + port; }
};

/// Sends changed tiles of a film to tev (https://github.com/Tom94/tev) by its TCP protocol, as one image with
/// channels R, G and B. Works in a thread of its own: a slow viewer skips updates, and a viewer that is
/// missing or closes the connection is tried again every few seconds. Rendering never waits for the viewer.
class DisplayServer {
  public:
    /// `name`: of the image in the viewer. `closingTime`: how long the destructor may wait until the
    /// remaining tiles are sent. `warn`: receives the first connection error, from the thread.
    DisplayServer(const ViewerAddress& address, const std::string& name, std::shared_ptr<LiveFilm> film,
                  std::chrono::milliseconds closingTime, std::function<void(const std::string&)> warn);
    ~DisplayServer();
    DisplayServer(const DisplayServer&) = delete;
    DisplayServer& operator=(const DisplayServer&) = delete;

  private:
    struct State;
    std::chrono::milliseconds m_closingTime;
    std::shared_ptr<State> m_state;
};

} // namespace strobe
