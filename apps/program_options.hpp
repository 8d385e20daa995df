#pragma once

#include <CLI/CLI.hpp>  // takes seconds to compile: only for sources that define options
#include <algorithm>
#include <exception>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>

namespace km {

/// Exit codes of all programs: for input that is missing or cannot be used, or such a disk; and for
/// an invalid command line, whatever the files hold. Other codes are those of a program.
inline constexpr int kBadInput = 1, kBadCommandLine = 2;

/// Adds --version, parses the words and calls the callbacks. Empty if the program continues.
/// Otherwise the exit code: 0 after --help, --version and a callback that throws CLI::Success. It
/// is kBadCommandLine for an invalid command line, whose error is printed to stderr. An unknown
/// word is often the reason why another one is missing, and is named instead, followed by
/// `hint_for_unknown`. Other exceptions of callbacks are passed on.
[[nodiscard]] std::optional<int> parse_options(CLI::App& app, int argc, const char* const* argv,
                                               const std::string& hint_for_unknown = {});

/// Replaces the text of an option by the path of find_named_file() in this folder. Exceptions are
/// passed on: a missing file is bad input.
[[nodiscard]] CLI::Validator named_file(const char* folder);

/// The main() of a program whose first word is a subcommand. Each of `adders` adds one, which runs
/// as soon as the command line names it. The exit code is 0 if the subcommand succeeded or help was
/// requested. It is kBadInput for an exception, with a message on stderr.
int run_subcommands(const std::string& program, const std::string& about,
                    std::initializer_list<void (*)(CLI::App&)> adders, int argc, char** argv);

/// Adds a subcommand to `app`. Its options are those that `define(CLI::App&)` of a Command adds,
/// and `run()` runs it as soon as the command line names it. The first line of `about` is its
/// title, which is all that the help of the program shows.
template <typename Command>
void add_command(CLI::App& app, const char* name, const std::string& about) {
  const std::size_t end = std::min(about.find('\n'), about.size());
  CLI::App& subcommand = *app.add_subcommand(name, about.substr(0, end));
  subcommand.footer(about.substr(std::min(end + 1, about.size())));
  const auto command = std::make_shared<Command>();
  command->define(subcommand);
  subcommand.callback([command] { command->run(); });
}

}  // namespace km
