// Messages of the session library.
#pragma once

#include "core/math/api.h"

#include <fmt/format.h>

#include <functional>
#include <string>

namespace STROBE_API strobe {

enum class LogLevel { Debug, Info, Warning, Error };

/// Formats messages with fmt and passes them to a sink.
struct Log {
    /// Receives one message, without a line end. It may be called by several threads at the same time. If
    /// empty, messages are discarded.
    std::function<void(LogLevel, const std::string&)> sink;

    template <class... Args>
    void write(LogLevel level, fmt::format_string<Args...> format, Args&&... args) const {
        if (sink)
            sink(level, fmt::format(format, std::forward<Args>(args)...));
    }
    template <class... Args>
    void debug(fmt::format_string<Args...> format, Args&&... args) const {
        write(LogLevel::Debug, format, std::forward<Args>(args)...);
    }
    template <class... Args>
    void info(fmt::format_string<Args...> format, Args&&... args) const {
        write(LogLevel::Info, format, std::forward<Args>(args)...);
    }
    template <class... Args>
    void warn(fmt::format_string<Args...> format, Args&&... args) const {
        write(LogLevel::Warning, format, std::forward<Args>(args)...);
    }
    template <class... Args>
    void error(fmt::format_string<Args...> format, Args&&... args) const {
        write(LogLevel::Error, format, std::forward<Args>(args)...);
    }
};

} // namespace strobe
