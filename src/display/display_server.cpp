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

constexpr auto kTick = 100ms;         ///< how often a waiting thread looks whether it is to end
constexpr auto kConnectPatience = 3s; ///< for a connection to come about
constexpr auto kRetry = 3s;           ///< from one attempt to the next

/// A connection that never blocks longer than it is told to.
class Connection {
  public:
    ~Connection() { close(); }
    bool isOpen() const { return m_fd >= 0; }
    void close() {
        if (m_fd >= 0)
            ::close(std::exchange(m_fd, -1));
    }

    /// Empty, or why it failed.
    std::string connect(const ViewerAddress& address, const std::function<bool()>& giveUp) {
        addrinfo hints{}, *found = nullptr;
        hints.ai_socktype = SOCK_STREAM;
        if (const int error = getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found))
            return gai_strerror(error);
        std::string reason = "no address";
        for (const addrinfo* a = found; a && !isOpen() && !giveUp(); a = a->ai_next) {
            m_fd = socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol);
            int error = errno;
            if (m_fd >= 0)
                error = ::connect(m_fd, a->ai_addr, a->ai_addrlen) == 0 ? 0 : errno;
            if (error == EINPROGRESS)
                error = await(Clock::now() + kConnectPatience, giveUp) ? pendingError() : ETIMEDOUT;
            if (error != 0)
                reason = std::strerror(error), close();
        }
        freeaddrinfo(found);
        return isOpen() ? "" : reason;
    }

    /// False: the connection is lost, or `giveUp` said so.
    bool send(std::string_view bytes, const std::function<bool()>& giveUp) {
        while (!bytes.empty()) {
            const ssize_t n = ::send(m_fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
            if (n >= 0)
                bytes.remove_prefix(size_t(n));
            else if (errno == EAGAIN || errno == EWOULDBLOCK) {
                if (!await(Clock::time_point::max(), giveUp))
                    return false;
            } else if (errno != EINTR)
                return false;
        }
        return true;
    }

  private:
    /// Waits until the socket can be written to.
    bool await(Clock::time_point until, const std::function<bool()>& giveUp) const {
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
                          const LiveFilm::Piece& piece) {
    TevMessage m(TevMessage::UpdateImage);
    m << false << std::string_view(name) << int32_t(3);
    for (const char* channel : {"R", "G", "B"})
        m << std::string_view(channel);
    m << int32_t(piece.pixelBounds.x0 - pixelBounds.x0) << int32_t(piece.pixelBounds.y0 - pixelBounds.y0)
      << int32_t(piece.pixelBounds.width()) << int32_t(piece.pixelBounds.height());
    for (const int64_t offset : {0, 1, 2})
        m << offset;
    for (int i = 0; i < 3; ++i)
        m << int64_t(3); // floats from pixel to pixel
    m.append(&piece.image.pixels[0].x, 3 * piece.image.pixels.size());
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
    const bool number = !address.port.empty() && address.port.size() <= 5 &&
                        address.port.find_first_not_of("0123456789") == std::string::npos;
    if (address.host.empty() || !number || std::stoi(address.port) < 1 || std::stoi(address.port) > 65535)
        return {};
    return address;
}

/// Shared with the thread, which may be left behind at the end of the program: looking up a host's name can
/// take long and cannot be cut short.
struct DisplayServer::State {
    const ViewerAddress address;
    const std::string name;
    const std::shared_ptr<LiveFilm> film;
    const std::function<void(const std::string&)> warn;
    std::atomic<Clock::rep> end{Clock::time_point::max().time_since_epoch().count()};
    std::promise<void> done{};
    std::mutex warning{}; ///< held while `warn` is called
    bool warned = false;

    bool ends() const { return end.load() != Clock::time_point::max().time_since_epoch().count(); }
    bool over() const { return Clock::now().time_since_epoch().count() > end.load(); }

    void run() {
        while (!over()) {
            Connection connection;
            const std::string reason = connection.connect(address, [this] { return over(); });
            if (connection.isOpen() && serve(connection))
                break;
            complain(reason.empty() ? "the connection was lost" : reason);
            for (const auto retry = Clock::now() + kRetry; !ends() && Clock::now() < retry;)
                std::this_thread::sleep_for(kTick);
            if (ends())
                break;
        }
        done.set_value();
    }

    /// True: everything was sent, and nothing more will come.
    bool serve(Connection& connection) {
        const auto send = [&](const std::string& bytes) {
            return connection.send(bytes, [this] { return over(); });
        };
        if (!send(createMessage(name, film->pixelBounds())))
            return false;
        film->touchAll();
        while (!over()) {
            const bool last = ends(); // then nothing changes any more
            const auto piece = film->nextChanged(last ? 0ms : kTick);
            if (piece && !send(updateMessage(name, film->pixelBounds(), *piece)))
                return false;
            if (!piece && last)
                return true;
        }
        return false;
    }

    void complain(const std::string& reason) {
        const std::lock_guard lock(warning);
        if (!std::exchange(warned, true))
            warn("no picture for the viewer at " + address.text() + ": " + reason);
    }
};

DisplayServer::DisplayServer(const ViewerAddress& address, const std::string& name,
                             std::shared_ptr<LiveFilm> film, std::chrono::milliseconds farewell,
                             std::function<void(const std::string&)> warn)
    : m_farewell(farewell), m_state(new State{address, name, std::move(film), std::move(warn)}) {
    std::thread([state = m_state] { state->run(); }).detach();
}

DisplayServer::~DisplayServer() {
    m_state->end.store((Clock::now() + m_farewell).time_since_epoch().count());
    m_state->done.get_future().wait_for(m_farewell + 2 * kTick);
    const std::lock_guard lock(m_state->warning);
    m_state->warned = true; // from now on there may be nobody to hear it
}

} // namespace strobe
