#include "session/fallback_writer.h"

#include "core/util/error.h"

#include <cstdlib>
#include <string>
#include <vector>

namespace strobe {
namespace {

namespace fs = std::filesystem;

/// Makes a folder with an unused name that only this user can access. Returns an empty path on failure.
fs::path newFolderIn(const fs::path& parent) {
    std::string name = (parent / "strobe-XXXXXX").string();
    return mkdtemp(name.data()) ? fs::path(name) : fs::path();
}

std::vector<fs::path> candidateParents() {
    std::vector<fs::path> folders;
    if (const char* variable = std::getenv("TMPDIR"); variable && *variable)
        folders.push_back(variable);
    folders.push_back("/tmp");
    std::error_code error;
    if (const fs::path current = fs::current_path(error); !error)
        folders.push_back(current);
    return folders;
}

} // namespace

bool FallbackWriter::write(const fs::path& file, const Write& write) {
    try {
        write(file);
        return true;
    } catch (const Error& e) {
        if (e.kind != ErrorKind::Output)
            throw;
        const std::lock_guard lock(m_mutex);
        m_wroteAll = false;
        m_log.error("error: {}", e.what());
        if (!writeToFallbackFolder(file, write))
            m_log.error("error: {} could not be written to another folder either", file.filename().string());
        return false;
    }
}

bool FallbackWriter::writeToFallbackFolder(const fs::path& file, const Write& write) {
    const std::vector<fs::path> parents = candidateParents();
    for (size_t i = 0; i < parents.size(); ++i) {
        const fs::path folder = i == 0 && !m_folder.empty() ? m_folder : newFolderIn(parents[i]);
        if (folder.empty())
            continue;
        try {
            const fs::path saved = folder / file.filename();
            write(saved);
            m_folder = folder;
            m_log.error("SAVED INSTEAD: {} is in {}", file.filename().string(), saved.string());
            return true;
        } catch (const Error&) {
            std::error_code ignored; // a new folder is empty: leaving it does no harm
            if (folder != m_folder)
                fs::remove(folder, ignored);
        }
    }
    return false;
}

} // namespace strobe
