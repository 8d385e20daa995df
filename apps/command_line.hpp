#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace km {

/// Thrown by callbacks of a command line that cannot be used. The message names the option.
class CommandLineError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  CommandLineError(const std::string& option, const std::string& why)
      : std::runtime_error(option + ": " + why) {}
};

/// Thrown by callbacks after which the program ends with exit code 0.
class CommandLineDone : public std::exception {};

/// One option of a Command: a handle, valid as long as the CommandLine. Each function changes the
/// option and returns the handle.
class CommandOption {
 public:
  explicit CommandOption(CLI::Option* option) : option_(option) {}

  CommandOption required() const;
  /// Splits a value at this character.
  CommandOption delimiter(char between) const;
  /// Number of values.
  CommandOption expected(int number) const { return expected(number, number); }
  CommandOption expected(int least, int most) const;
  /// Sets the text that --help shows in place of the type of the value.
  CommandOption type_name(const std::string& name) const;
  /// Sets the text that --help shows as the default.
  CommandOption default_text(const std::string& text) const;
  /// --help shows the present value of the variable as the default.
  CommandOption show_default() const;
  /// The option is allowed only with the other one.
  CommandOption needs(CommandOption other) const;
  /// The option is not allowed with the other one.
  CommandOption excludes(CommandOption other) const;

  CommandOption within(int least, int most) const;
  CommandOption within(double least, double most) const;
  CommandOption positive() const;
  CommandOption not_negative() const;
  CommandOption existing_file() const;
  CommandOption existing_folder() const;
  /// File or folder.
  CommandOption existing_path() const;
  /// One of `values`, which --help lists.
  CommandOption one_of(const std::vector<std::string>& values) const;
  /// One of `values`, which the text of the option explains.
  CommandOption one_of_unlisted(const std::vector<std::string>& values) const;
  /// `why_wrong` returns why a value cannot be used, or an empty text.
  CommandOption check(const std::function<std::string(const std::string&)>& why_wrong) const;

  /// True once the option is parsed.
  [[nodiscard]] bool is_given() const;

 private:
  CLI::Option* option_;
};

/// Options of a program, of its subcommand, or of a group: a handle, valid as long as the
/// CommandLine. Variables and what callbacks refer to must live until the end of the parsing.
class Command {
 public:
  explicit Command(CLI::App* app) : app_(app) {}

  /// Adds an option "--name", "-n,--name" or "POSITIONAL" that sets `value`. Exists for the types
  /// at the end of command_line.cpp.
  template <typename T>
  CommandOption add_option(const std::string& name, T& value, const std::string& about = {}) const;
  /// Adds an option whose value is passed to `use`. Exists for the types at the end of
  /// command_line.cpp.
  template <typename T>
  CommandOption add_option_function(const std::string& name,
                                    const std::function<void(const T&)>& use,
                                    const std::string& about) const;
  /// Adds a flag that sets `value`; "!--no-name" resets it.
  CommandOption add_flag(const std::string& name, bool& value, const std::string& about) const;
  CommandOption add_flag_callback(const std::string& name, const std::function<void()>& use,
                                  const std::string& about) const;
  /// Passes how often the flag is given; negative if it is given as false.
  CommandOption add_flag_function(const std::string& name,
                                  const std::function<void(std::int64_t)>& use,
                                  const std::string& about) const;

  /// Heading in --help of the options that are added next.
  void group(const std::string& heading) const;
  /// --help shows the defaults of the options that are added next.
  void show_defaults() const;
  /// Options under a heading of their own, exactly one of which must be given.
  [[nodiscard]] Command add_choice_group(const std::string& heading,
                                         const std::string& about) const;
  Command add_subcommand(const std::string& name, const std::string& about) const;
  /// A subcommand is required. With `shares_options`, options of the program may follow it.
  void require_subcommand(bool shares_options = false) const;

  /// Sets the text that --help shows after the options.
  void footer(const std::string& text) const;
  /// `run` is called once all options are parsed.
  void callback(const std::function<void()>& run) const;

  /// Number of values that the option has received, or how often the flag was given.
  [[nodiscard]] std::size_t count(const std::string& option) const;
  /// These values as they were written.
  [[nodiscard]] std::vector<std::string> values(const std::string& option) const;
  /// True if the command line names this subcommand.
  [[nodiscard]] bool is_parsed() const;
  /// A row for each subcommand, with its name and the first line about it. Empty once one is
  /// parsed.
  [[nodiscard]] std::string list_subcommands() const;

 private:
  CLI::App* app_;
};

/// The command line of a program with --help and --version. The only interface to CLI11, whose
/// headers take seconds to compile. Not thread-safe.
class CommandLine {
 public:
  /// The version is version_text(program).
  CommandLine(const std::string& program, const std::string& about);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  [[nodiscard]] Command command() const;
  /// Printed after the error for words that no option takes.
  void hint_for_unknown(const std::string& text) { hint_for_unknown_ = text; }

  /// Parses and calls the callbacks. Empty if the program continues. Otherwise the exit code: 0
  /// after --help, --version and CommandLineDone. It is `exit_code_if_wrong` for an invalid command
  /// line, whose error is printed to stderr. An unknown word is often the reason why another one is
  /// missing, and is named instead. Other exceptions of callbacks are passed on.
  [[nodiscard]] std::optional<int> parse(int argc, const char* const* argv, int exit_code_if_wrong);
  /// Parses words without the program's name. Throws a std::exception for an invalid command line.
  void parse_words(std::vector<std::string> words);

 private:
  std::unique_ptr<CLI::App> app_;
  std::string hint_for_unknown_;
};

/// The main() of a program whose first word is a subcommand. Each of `adders` adds one, which runs
/// as soon as the command line names it. The exit code is 0 if the subcommand succeeded or help was
/// requested. It is 1 for an exception, with a message on stderr, and for an invalid command line.
int run_subcommands(const std::string& program, const std::string& about,
                    std::initializer_list<void (*)(Command)> adders, int argc, char** argv);

}  // namespace km
