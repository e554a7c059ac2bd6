#include "cli/help.h"

#include "core/util/error.h"
#include "core/util/version.h"

#include <fmt/format.h>

namespace strobe {

namespace {

constexpr size_t kLineWidth = 100;
constexpr size_t kTextColumn = 30;

/// Returns the text in lines that end before kLineWidth, if each begins at `column`.
std::vector<std::string> wrapped(const std::string& text, size_t column) {
    std::vector<std::string> lines{""};
    std::istringstream words(text);
    for (std::string word; words >> word;) {
        if (!lines.back().empty() && column + lines.back().size() + 1 + word.size() > kLineWidth)
            lines.emplace_back();
        lines.back() += (lines.back().empty() ? "" : " ") + word;
    }
    return lines;
}

/// Returns "-o,--output FILE ...", as the help shows an option.
std::string usageOf(const CLI::Option& option) {
    const std::string names = option.get_name(option.get_positional(), true);
    const std::string type = option.get_items_expected_max() == 0 ? "" : option.get_type_name();
    const bool isRepeatable = option.get_items_expected_max() >= CLI::detail::expected_max_vector_size;
    return names + (type.empty() ? "" : " " + type) + (isRepeatable ? " ..." : "");
}

class WideFormatter final : public CLI::Formatter {
  public:
    std::string make_option(const CLI::Option* option, bool) const override {
        std::string left = "  " + usageOf(*option), out;
        if (left.size() + 2 > kTextColumn) {
            out = left + '\n';
            left.clear();
        }
        for (const std::string& line : wrapped(option->get_description(), kTextColumn)) {
            left.resize(kTextColumn, ' ');
            out += left + line + '\n';
            left.clear();
        }
        return out;
    }
};

/// Returns the options that the help lists, group by group.
std::vector<std::pair<std::string, std::vector<const CLI::Option*>>> groupsOf(const CLI::App& app) {
    std::vector<std::pair<std::string, std::vector<const CLI::Option*>>> groups;
    for (const std::string& name : app.get_groups()) {
        const auto options = app.get_options([&](const CLI::Option* option) {
            return option->get_group() == name && option->nonpositional();
        });
        if (!name.empty() && !options.empty())
            groups.emplace_back(name, options);
    }
    return groups;
}

/// Returns a text in which troff reads no commands.
std::string forTroff(const std::string& text) {
    std::string out;
    for (const char c : text)
        out += c == '\\' ? "\\e" : c == '-' ? "\\-" : std::string(1, c);
    return out.empty() || (out[0] != '.' && out[0] != '\'') ? out : "\\&" + out;
}

/// All names of an option, with dashes.
std::vector<std::string> namesOf(const CLI::Option& option) {
    std::vector<std::string> names;
    for (const std::string& name : option.get_snames())
        names.push_back("-" + name);
    for (const std::string& name : option.get_lnames())
        names.push_back("--" + name);
    return names;
}

/// Returns a text between single quotes of a shell.
std::string quoted(const std::string& text) {
    std::string out = "'";
    for (const char c : text)
        out += c == '\'' ? "'\\''" : std::string(1, c);
    return out + "'";
}

const std::vector<std::string>* wordsOf(const CLI::Option& option,
                                        const std::vector<Completion>& completions) {
    for (const Completion& completion : completions)
        for (const std::string& name : namesOf(option))
            if (name == completion.option)
                return &completion.words;
    return nullptr;
}

/// The start of a description: completions show one short line.
std::string summaryOf(const CLI::Option& option) {
    const std::string& text = option.get_description();
    return text.substr(0, std::min(text.find_first_of(";("), text.find(": ")));
}

bool takesArgument(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

std::string bashScript(const CLI::App& app, const std::vector<Completion>& completions) {
    std::string names, cases;
    for (const auto& [group, options] : groupsOf(app))
        for (const CLI::Option* option : options) {
            const auto all = namesOf(*option);
            names += fmt::format(" {}", fmt::join(all, " "));
            if (const auto* words = wordsOf(*option, completions))
                cases += fmt::format("    {}) COMPREPLY=($(compgen -W {} -- \"$current\")); return ;;\n",
                                     fmt::join(all, "|"), quoted(fmt::format("{}", fmt::join(*words, " "))));
        }
    return fmt::format(R"(# Completion of strobe for bash.
_strobe() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}}
  case $previous in
{}  esac
  if [[ $current == -* ]]; then
    COMPREPLY=($(compgen -W '{}' -- "$current"))
  else
    COMPREPLY=($(compgen -f -- "$current"))
  fi
}}
complete -o filenames -F _strobe strobe
)",
                       cases, names.substr(1));
}

std::string zshScript(const CLI::App& app, const std::vector<Completion>& completions) {
    std::string specs;
    for (const auto& [group, options] : groupsOf(app))
        for (const CLI::Option* option : options) {
            std::string text = summaryOf(*option);
            std::erase_if(text, [](char c) { return c == '[' || c == ']'; });
            const auto* words = wordsOf(*option, completions);
            const std::string argument =
                !takesArgument(*option) ? ""
                : words ? fmt::format(":{}:({})", option->get_type_name(), fmt::join(*words, " "))
                        : ":file:_files";
            for (const std::string& name : namesOf(*option))
                specs += fmt::format("  {} \\\n", quoted(fmt::format("*{}[{}]{}", name, text, argument)));
        }
    return "#compdef strobe\n# Completion of strobe for zsh.\n_arguments -s \\\n" + specs +
           "  '*:scene:_files'\n";
}

std::string fishScript(const CLI::App& app, const std::vector<Completion>& completions) {
    std::string lines = "# Completion of strobe for fish.\n";
    for (const auto& [group, options] : groupsOf(app))
        for (const CLI::Option* option : options) {
            std::string line = "complete -c strobe";
            for (const std::string& name : option->get_snames())
                line += " -s " + name;
            for (const std::string& name : option->get_lnames())
                line += " -l " + name;
            if (const auto* words = wordsOf(*option, completions))
                line += " -x -a " + quoted(fmt::format("{}", fmt::join(*words, " ")));
            else if (takesArgument(*option))
                line += " -r";
            lines += line + " -d " + quoted(summaryOf(*option)) + '\n';
        }
    return lines;
}

} // namespace

void useWideHelp(CLI::App& app) { app.formatter(std::make_shared<WideFormatter>()); }

std::string manPage(const CLI::App& app) {
    std::string page =
        fmt::format(".TH STROBE 1 \"\" \"strobe {}\" \"User Commands\"\n.SH NAME\nstrobe \\- a "
                    "pbrt\\-style renderer that shades less often than it samples visibility\n",
                    version());
    page +=
        ".SH SYNOPSIS\n.B strobe\n[\\fIOPTIONS\\fR] \\fIFILE\\fR...\n.br\n.B strobe merge\n\\fIPART\\fR... "
        "\\fB\\-o\\fR \\fIOUT\\fR...\n.SH DESCRIPTION\nRenders scene files (.scene, .pbrt, .gltf, .glb), "
        "read "
        "one after another as if they were one file; \\- is standard input.\n.SH OPTIONS\n";
    for (const auto& [group, options] : groupsOf(app)) {
        page += ".SS " + forTroff(group) + '\n';
        for (const CLI::Option* option : options)
            page += fmt::format(".TP\n.B {}\n{}\n", forTroff(usageOf(*option)),
                                forTroff(option->get_description()));
    }
    page += ".SH EXIT STATUS AND MORE\n.nf\n";
    std::istringstream footer(app.get_footer());
    for (std::string line; std::getline(footer, line);)
        page += forTroff(line) + '\n';
    return page + ".fi\n.SH ENVIRONMENT\n.TP\n.B OCIO\nThe OpenColorIO config of textures and views.\n";
}

std::string completionScript(const CLI::App& app, const std::vector<Completion>& completions,
                             const std::string& shell) {
    if (shell == "bash")
        return bashScript(app, completions);
    if (shell == "zsh")
        return zshScript(app, completions);
    if (shell == "fish")
        return fishScript(app, completions);
    throw Error("--print-completion: unknown shell \"" + shell + "\" (known: bash, zsh, fish)",
                ErrorKind::Usage);
}

} // namespace strobe
