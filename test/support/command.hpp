#pragma once

#include <sys/wait.h>

#include "test/support/test.hpp"

namespace km {

/// The words of a command line, separated by spaces.
inline std::vector<std::string> words_of(const std::string& line) {
  std::istringstream text(line);
  std::vector<std::string> words;
  for (std::string word; text >> word;) words.push_back(word);
  return words;
}

/// Exit code and output of a program.
struct CommandResult {
  int exit_code = -1;  ///< -1 if it was ended by a signal.
  std::string output;  ///< Standard output and error together.
};

/// True for the exit code of all programs: 2 for an invalid command line, whose message refers to
/// --help, and 1 for input that cannot be used.
inline bool is_refused(const CommandResult& result) {
  const bool is_command_line = result.output.find("Run with --help") != std::string::npos ||
                               result.output.find("must be a subcommand") != std::string::npos;
  return result.exit_code == (is_command_line ? 2 : 1);
}

/// Runs a shell command to its end.
inline CommandResult run_command(const std::string& command) {
  CommandResult result;
  FILE* const pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("cannot run " + command);
  std::array<char, 4096> buffer{};
  for (std::size_t n = 0; (n = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;)
    result.output.append(buffer.data(), n);
  const int status = pclose(pipe);
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  return result;
}

/// The result of a program that must end with exit code 0. Otherwise the test fails and shows its
/// output.
inline CommandResult succeeded(CommandResult result) {
  INFO(result.output);
  REQUIRE(result.exit_code == 0);
  return result;
}

}  // namespace km
