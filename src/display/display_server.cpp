#include "display/display_server.h"

#include "display/tev_message.h"

#include <atomic>
#include <cerrno>
#include <future>
#include <thread>

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace strobe {

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kTick = 100ms;        ///< interval at which waiting threads check whether to end
constexpr auto kConnectTimeout = 3s; ///< of one attempt to connect
constexpr auto kRetryInterval = 3s;  ///< between attempts to connect

/// A TCP connection. Waiting ends when `giveUp` returns true.
class Connection {
  public:
    ~Connection() { close(); }
    bool isOpen() const { return m_fd >= 0; }
    void close() {
        if (m_fd >= 0)
            ::close(std::exchange(m_fd, -1));
    }

    /// Returns the reason of a failure; empty if the connection is open.
    std::string connect(const ViewerAddress& address, const std::function<bool()>& giveUp) {
        addrinfo hints{};
        addrinfo* addresses = nullptr;
        hints.ai_socktype = SOCK_STREAM;
        if (const int error = getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &addresses))
            return gai_strerror(error);
        std::string reason = "no address";
        for (const addrinfo* a = addresses; a && !isOpen() && !giveUp(); a = a->ai_next)
            if (const int error = connectTo(*a, giveUp); error != 0) {
                reason = std::strerror(error);
                close();
            }
        freeaddrinfo(addresses);
        return isOpen() ? "" : reason;
    }

    /// Returns false if the connection is lost, or given up.
    bool send(std::string_view bytes, const std::function<bool()>& giveUp) {
        while (!bytes.empty()) {
            const ssize_t n = ::send(m_fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
            if (n >= 0)
                bytes.remove_prefix(size_t(n));
            else if (errno == EAGAIN || errno == EWOULDBLOCK) {
                if (!waitUntilWritable(Clock::time_point::max(), giveUp))
                    return false;
            } else if (errno != EINTR)
                return false;
        }
        return true;
    }

  private:
    /// Returns 0 or the error number.
    int connectTo(const addrinfo& address, const std::function<bool()>& giveUp) {
        m_fd = socket(address.ai_family, address.ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC,
                      address.ai_protocol);
        if (m_fd < 0)
            return errno;
        const int error = ::connect(m_fd, address.ai_addr, address.ai_addrlen) == 0 ? 0 : errno;
        if (error != EINPROGRESS)
            return error;
        return waitUntilWritable(Clock::now() + kConnectTimeout, giveUp) ? pendingError() : ETIMEDOUT;
    }
    bool waitUntilWritable(Clock::time_point until, const std::function<bool()>& giveUp) const {
        while (!giveUp() && Clock::now() < until) {
            pollfd p{m_fd, POLLOUT, 0};
            if (poll(&p, 1, int(std::chrono::milliseconds(kTick).count())) > 0)
                return true;
        }
        return false;
    }
    int pendingError() const {
        int error = 0;
        socklen_t size = sizeof error;
        return getsockopt(m_fd, SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
    }

    int m_fd = -1;
};

std::string createMessage(const std::string& name, const PixelBounds& pixelBounds) {
    TevMessage m(TevMessage::CreateImage);
    m << true << std::string_view(name) << int32_t(pixelBounds.width()) << int32_t(pixelBounds.height())
      << int32_t(3);
    for (const char* channel : {"R", "G", "B"})
        m << std::string_view(channel);
    return std::move(m).bytes();
}

std::string updateMessage(const std::string& name, const PixelBounds& pixelBounds,
                          const LiveFilm::Tile& tile) {
    TevMessage m(TevMessage::UpdateImage);
    m << false << std::string_view(name) << int32_t(3);
    for (const char* channel : {"R", "G", "B"})
        m << std::string_view(channel);
    m << int32_t(tile.pixelBounds.x0 - pixelBounds.x0) << int32_t(tile.pixelBounds.y0 - pixelBounds.y0)
      << int32_t(tile.pixelBounds.width()) << int32_t(tile.pixelBounds.height());
    for (const int64_t offset : {0, 1, 2})
        m << offset;
    for (int i = 0; i < 3; ++i)
        m << int64_t(3); // stride between pixels, in floats
    m.append(&tile.image.pixels[0].x, 3 * tile.image.pixels.size());
    return std::move(m).bytes();
}

} // namespace

std::optional<ViewerAddress> ViewerAddress::parse(const std::string& text) {
    ViewerAddress address{text, "14158"};
    const size_t colon = text.rfind(':');
    if (!text.empty() && text[0] == '[') {
        const size_t end = text.find(']');
        if (end == std::string::npos || (end + 1 != text.size() && end + 1 != colon))
            return {};
        address.host = text.substr(1, end - 1);
        if (end + 1 == colon)
            address.port = text.substr(colon + 1);
    } else if (colon != std::string::npos) {
        address = {text.substr(0, colon), text.substr(colon + 1)};
    }
    const bool isNumber = !address.port.empty() && address.port.size() <= 5 &&
                          address.port.find_first_not_of("0123456789") == std::string::npos;
    if (address.host.empty() || !isNumber || std::stoi(address.port) < 1 || std::stoi(address.port) > 65535)
        return {};
    return address;
}

/// Shared with the thread, which may outlive the server: resolving a host name can take long and cannot be
/// interrupted.
struct DisplayServer::State {
    const ViewerAddress address;
    const std::string name;
    const std::shared_ptr<LiveFilm> film;
    const std::function<void(const std::string&)> warn;
    /// Time at which sending stops; the maximum while the server exists.
    std::atomic<Clock::rep> end{Clock::time_point::max().time_since_epoch().count()};
    std::promise<void> done{};
    std::mutex warnMutex{}; ///< held while `warn` is called
    bool hasWarned = false;

    bool isClosing() const { return end.load() != Clock::time_point::max().time_since_epoch().count(); }
    bool isOver() const { return Clock::now().time_since_epoch().count() > end.load(); }

    void run() {
        while (!isOver()) {
            Connection connection;
            const std::string reason = connection.connect(address, [this] { return isOver(); });
            if (connection.isOpen() && sendTiles(connection))
                break;
            warnOnce(reason.empty() ? "the connection was lost" : reason);
            for (const auto retry = Clock::now() + kRetryInterval; !isClosing() && Clock::now() < retry;)
                std::this_thread::sleep_for(kTick);
            if (isClosing())
                break;
        }
        done.set_value();
    }

    /// Returns whether all tiles were sent and the server is closing.
    bool sendTiles(Connection& connection) {
        const auto send = [&](const std::string& bytes) {
            return connection.send(bytes, [this] { return isOver(); });
        };
        if (!send(createMessage(name, film->pixelBounds())))
            return false;
        film->markAllChanged();
        while (!isOver()) {
            const bool isLast = isClosing(); // then no tile changes any more
            const auto tile = film->nextChanged(isLast ? 0ms : kTick);
            if (tile && !send(updateMessage(name, film->pixelBounds(), *tile)))
                return false;
            if (!tile && isLast)
                return true;
        }
        return false;
    }

    void warnOnce(const std::string& reason) {
        const std::lock_guard lock(warnMutex);
        if (!std::exchange(hasWarned, true))
            warn("no connection to the viewer at " + address.text() + ": " + reason);
    }
};

DisplayServer::DisplayServer(const ViewerAddress& address, const std::string& name,
                             std::shared_ptr<LiveFilm> film, std::chrono::milliseconds closingTime,
                             std::function<void(const std::string&)> warn)
    : m_closingTime(closingTime), m_state(new State{address, name, std::move(film), std::move(warn)}) {
    std::thread([state = m_state] { state->run(); }).detach();
}

DisplayServer::~DisplayServer() {
    m_state->end.store((Clock::now() + m_closingTime).time_since_epoch().count());
    m_state->done.get_future().wait_for(m_closingTime + 2 * kTick);
    const std::lock_guard lock(m_state->warnMutex);
    m_state->hasWarned = true; // `warn` may refer to objects that end with the caller
}

} // namespace strobe
