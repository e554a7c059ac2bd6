// The texts that are made from the table of options: the help, the man page, and completions for shells.
#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace strobe {

/// Makes `app` print its help in lines of at most 100 bytes.
void useWideHelp(CLI::App& app);

/// Returns the page strobe(1) in the format of man, from the options of `app`.
std::string manPage(const CLI::App& app);

/// The words that complete the argument of an option, such as the names of integrators.
struct Completion {
    std::string option; ///< its long name
    std::vector<std::string> words;
};

/// Returns a completion script for `shell`: bash, zsh or fish. Options without words in `completions`
/// complete to names of files. Throws Error of kind Usage for other shells.
std::string completionScript(const CLI::App& app, const std::vector<Completion>& completions,
                             const std::string& shell);

} // namespace strobe
