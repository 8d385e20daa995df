#include <catch2/catch.hpp>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "apps/command_line.hpp"

namespace km {
namespace {

// Collects what is written to std::cerr.
class CapturedErrors {
 public:
  CapturedErrors() : before_(std::cerr.rdbuf(text_.rdbuf())) {}
  ~CapturedErrors() { std::cerr.rdbuf(before_); }
  CapturedErrors(const CapturedErrors&) = delete;
  CapturedErrors& operator=(const CapturedErrors&) = delete;
  [[nodiscard]] std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
  std::streambuf* before_;
};

struct Parsed {
  std::optional<int> exit_code;
  std::string errors;
};

constexpr int kWrong = 7;

Parsed parse(CommandLine& line, std::vector<const char*> words) {
  words.insert(words.begin(), "program");
  const CapturedErrors errors;
  const auto exit_code = line.parse(static_cast<int>(words.size()), words.data(), kWrong);
  return {exit_code, errors.text()};
}

// A program with one option of each kind.
struct Program {
  CommandLine line{"program", "About it."};
  std::string name;
  int number = 3;
  std::optional<double> ratio;
  std::vector<std::uint32_t> ids;
  bool is_quick = false, is_checked = true;

  Program() {
    const Command app = line.command();
    app.add_option("NAME", name, "A name").required();
    const CommandOption limit = app.add_option("--number", number, "A number").within(0, 9);
    app.add_option("--ratio", ratio, "A ratio").positive().needs(limit);
    app.add_option("--ids", ids, "Numbers").delimiter(',');
    app.add_flag("--quick", is_quick, "Quick");
    app.add_flag("!--unchecked", is_checked, "Without a check");
  }
};

int commands_run = 0;

void add_count(Command parent) {
  parent.add_subcommand("count", "Counts\nin the second line").callback([] { ++commands_run; });
}

void add_failure(Command parent) {
  parent.add_subcommand("fail", "Fails").callback([] { throw std::runtime_error("no file"); });
}

Parsed run_program(std::vector<std::string> words) {
  words.insert(words.begin(), "program");
  std::vector<char*> argv;
  argv.reserve(words.size());
  for (std::string& word : words) argv.push_back(word.data());
  const CapturedErrors errors;
  const int exit_code = run_subcommands("program", "About it.", {add_count, add_failure},
                                        static_cast<int>(argv.size()), argv.data());
  return {exit_code, errors.text()};
}

}  // namespace

TEST_CASE("Options set their variables, and others keep their values", "[program]") {
  Program program;
  const Parsed parsed =
      parse(program.line, {"a", "--ids", "4,5", "--quick", "--unchecked", "--number", "2"});
  CHECK_FALSE(parsed.exit_code);
  CHECK(parsed.errors.empty());
  CHECK(program.name == "a");
  CHECK(program.number == 2);
  CHECK(program.ids == std::vector<std::uint32_t>{4, 5});
  CHECK(program.is_quick);
  CHECK_FALSE(program.is_checked);
  CHECK_FALSE(program.ratio);
  CHECK(program.line.command().count("--number") == 1);
  CHECK(program.line.command().count("--ratio") == 0);
}

TEST_CASE("An invalid command line gives the exit code and a message with the option",
          "[program]") {
  const auto [words, named] = GENERATE(table<std::vector<const char*>, std::string>({
      {{"a", "--number", "10"}, "--number: Value 10 not in range 0 to 9"},
      {{"a", "--number", "many"}, "--number: Value many not in range 0 to 9"},
      {{"a", "--number"}, "--number"},
      {{"a", "--number", "1", "--ratio", "-1"}, "--ratio: Value -1 not in range"},
      {{"a", "--ratio", "1"}, "--ratio requires --number"},
      {std::vector<const char*>(), "NAME is required"},
      {{"a", "--nmber", "1"}, "--nmber"},
  }));
  Program program;
  const Parsed parsed = parse(program.line, words);
  CAPTURE(parsed.errors);
  CHECK(parsed.exit_code == kWrong);
  CHECK_THAT(parsed.errors, Catch::Contains(named));
}

TEST_CASE("An unknown word is named in place of the option that is missing for it", "[program]") {
  Program program;
  program.line.hint_for_unknown("Options of others come after --\n");
  const Parsed parsed = parse(program.line, {"--nmber"});
  CHECK(parsed.exit_code == kWrong);
  CHECK_THAT(parsed.errors, Catch::Contains("--nmber") && !Catch::Contains("NAME"));
}

TEST_CASE("The hint for unknown words follows their names", "[program]") {
  Program program;
  program.line.hint_for_unknown("Options of others come after --\n");
  const Parsed parsed = parse(program.line, {"a", "more"});
  CHECK(parsed.exit_code == kWrong);
  CHECK_THAT(parsed.errors,
             Catch::Contains("more") && Catch::EndsWith("Options of others come after --\n"));
}

TEST_CASE("Exactly one option of a choice group is given", "[program]") {
  const auto [words, is_valid] =
      GENERATE(table<std::vector<const char*>, bool>({{std::vector<const char*>(), false},
                                                      {{"--a", "1"}, true},
                                                      {{"--b", "1"}, true},
                                                      {{"--a", "1", "--b", "1"}, false}}));
  CommandLine line("program", "About it.");
  std::string a, b;
  const Command group = line.command().add_choice_group("Input", "From where");
  group.add_option("--a", a, "One");
  group.add_option("--b", b, "Another");
  CHECK(parse(line, words).exit_code.has_value() != is_valid);
}

TEST_CASE("A callback can refuse its option, or end the program", "[program]") {
  CommandLine line("program", "About it.");
  line.command().add_option_function<std::string>(
      "--refused", [](const std::string& text) { throw CommandLineError("--refused", text); }, "");
  line.command().add_flag_callback(
      "--done", [] { throw CommandLineDone(); }, "");
  const Parsed refused = parse(line, {"--refused", "why"});
  CHECK(refused.exit_code == kWrong);
  CHECK_THAT(refused.errors, Catch::StartsWith("--refused: why\n"));
  const Parsed done = parse(line, {"--done"});
  CHECK(done.exit_code == 0);
  CHECK(done.errors.empty());
}

TEST_CASE("A subcommand runs once and its failure is the program's", "[program]") {
  commands_run = 0;
  CHECK(run_program({"count"}).exit_code == 0);
  CHECK(commands_run == 1);
  const Parsed failed = run_program({"fail"});
  CHECK(failed.exit_code == 1);
  CHECK(failed.errors == "program: no file\n");
}

TEST_CASE("Without a subcommand the program lists them", "[program]") {
  const std::vector<std::string> words =
      GENERATE(std::vector<std::string>{}, std::vector<std::string>{"cont"});
  const Parsed parsed = run_program(words);
  CHECK(parsed.exit_code == 1);
  CHECK_THAT(parsed.errors, Catch::EndsWith("program: the first word must be a subcommand:\n"
                                            "  count  Counts\n  fail  Fails\n"));
}

}  // namespace km
