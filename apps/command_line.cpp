#include "apps/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>

#include "apps/program_version.hpp"

namespace km {

CommandOption CommandOption::required() const {
  option_->required();
  return *this;
}

CommandOption CommandOption::delimiter(char between) const {
  option_->delimiter(between);
  return *this;
}

CommandOption CommandOption::expected(int least, int most) const {
  option_->expected(least, most);
  return *this;
}

CommandOption CommandOption::type_name(const std::string& name) const {
  option_->type_name(name);
  return *this;
}

CommandOption CommandOption::default_text(const std::string& text) const {
  option_->default_str(text);
  return *this;
}

CommandOption CommandOption::show_default() const {
  option_->capture_default_str();
  return *this;
}

CommandOption CommandOption::needs(CommandOption other) const {
  option_->needs(other.option_);
  return *this;
}

CommandOption CommandOption::excludes(CommandOption other) const {
  option_->excludes(other.option_);
  return *this;
}

CommandOption CommandOption::within(int least, int most) const {
  option_->check(CLI::Range(least, most));
  return *this;
}

CommandOption CommandOption::within(double least, double most) const {
  option_->check(CLI::Range(least, most));
  return *this;
}

CommandOption CommandOption::positive() const {
  option_->check(CLI::PositiveNumber);
  return *this;
}

CommandOption CommandOption::not_negative() const {
  option_->check(CLI::NonNegativeNumber);
  return *this;
}

CommandOption CommandOption::existing_file() const {
  option_->check(CLI::ExistingFile);
  return *this;
}

CommandOption CommandOption::existing_folder() const {
  option_->check(CLI::ExistingDirectory);
  return *this;
}

CommandOption CommandOption::existing_path() const {
  option_->check(CLI::ExistingPath);
  return *this;
}

CommandOption CommandOption::one_of(const std::vector<std::string>& values) const {
  option_->check(CLI::IsMember(values));
  return *this;
}

CommandOption CommandOption::one_of_unlisted(const std::vector<std::string>& values) const {
  option_->check(CLI::IsMember(values).description(""));
  return *this;
}

CommandOption CommandOption::check(
    const std::function<std::string(const std::string&)>& why_wrong) const {
  option_->check(why_wrong);
  return *this;
}

bool CommandOption::is_given() const {
  return option_->count() > 0;
}

template <typename T>
CommandOption Command::add_option(const std::string& name, T& value,
                                  const std::string& about) const {
  return CommandOption(app_->add_option(name, value, about));
}

template <typename T>
CommandOption Command::add_option_function(const std::string& name,
                                           const std::function<void(const T&)>& use,
                                           const std::string& about) const {
  return CommandOption(app_->add_option_function<T>(name, use, about));
}

CommandOption Command::add_flag(const std::string& name, bool& value,
                                const std::string& about) const {
  return CommandOption(app_->add_flag(name, value, about));
}

CommandOption Command::add_flag_callback(const std::string& name, const std::function<void()>& use,
                                         const std::string& about) const {
  return CommandOption(app_->add_flag_callback(name, use, about));
}

CommandOption Command::add_flag_function(const std::string& name,
                                         const std::function<void(std::int64_t)>& use,
                                         const std::string& about) const {
  return CommandOption(app_->add_flag_function(name, use, about));
}

void Command::group(const std::string& heading) const {
  app_->option_defaults()->group(heading);
}

void Command::show_defaults() const {
  app_->option_defaults()->always_capture_default();
}

Command Command::add_choice_group(const std::string& heading, const std::string& about) const {
  auto* const group = app_->add_option_group(heading, about);
  group->require_option(1);
  return Command(group);
}

Command Command::add_subcommand(const std::string& name, const std::string& about) const {
  return Command(app_->add_subcommand(name, about));
}

void Command::require_subcommand(bool shares_options) const {
  app_->require_subcommand(1);
  app_->fallthrough(shares_options);
}

void Command::footer(const std::string& text) const {
  app_->footer(text);
}

void Command::callback(const std::function<void()>& run) const {
  app_->callback(run);
}

std::size_t Command::count(const std::string& option) const {
  return app_->count(option);
}

std::vector<std::string> Command::values(const std::string& option) const {
  return app_->get_option(option)->results();
}

bool Command::is_parsed() const {
  return app_->parsed();
}

std::string Command::list_subcommands() const {
  std::string text;
  if (!app_->get_subcommands().empty()) return text;
  for (const CLI::App* one : std::as_const(*app_).get_subcommands(nullptr)) {
    const std::string about = one->get_description();
    text += "  " + one->get_name() + "  " + about.substr(0, about.find('\n')) + '\n';
  }
  return text;
}

CommandLine::CommandLine(const std::string& program, const std::string& about)
    : app_(std::make_unique<CLI::App>(about)) {
  app_->set_version_flag("--version", version_text(program));
}

CommandLine::~CommandLine() = default;

Command CommandLine::command() const {
  return Command(app_.get());
}

std::optional<int> CommandLine::parse(int argc, const char* const* argv, int exit_code_if_wrong) {
  try {
    app_->parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::RequiredError& error) {
    auto unknown = app_->remaining(true);
    std::ranges::reverse(unknown);  // ExtrasError lists the last one first
    if (unknown.empty())
      app_->exit(error);
    else
      app_->exit(CLI::ExtrasError(app_->get_name(), unknown));
  } catch (const CLI::ExtrasError& error) {
    app_->exit(error);
    std::cerr << hint_for_unknown_;
  } catch (const CLI::ParseError& error) {
    if (app_->exit(error) == 0) return 0;  // --help or --version
  } catch (const CommandLineError& error) {
    app_->exit(CLI::ValidationError(error.what()));
  } catch (const CommandLineDone&) {
    return 0;
  }
  return exit_code_if_wrong;
}

void CommandLine::parse_words(std::vector<std::string> words) {
  std::ranges::reverse(words);  // CLI11 takes them from the end
  app_->parse(std::move(words));
}

int run_subcommands(const std::string& program, const std::string& about,
                    std::initializer_list<void (*)(Command)> adders, int argc, char** argv) try {
  CommandLine line(program, about);
  line.command().require_subcommand();
  for (const auto add : adders) add(line.command());
  const std::optional<int> exit_code = line.parse(argc, argv, 1);
  if (exit_code.value_or(0) == 0) return 0;
  const std::string list = line.command().list_subcommands();
  if (!list.empty()) std::cerr << program << ": the first word must be a subcommand:\n" << list;
  return *exit_code;
} catch (const std::exception& error) {
  std::cerr << program << ": " << error.what() << '\n';
  return 1;
}

// Types of values in use.
using Text = const std::string&;
template CommandOption Command::add_option(Text, int&, Text) const;
template CommandOption Command::add_option(Text, std::uint16_t&, Text) const;
template CommandOption Command::add_option(Text, std::int64_t&, Text) const;
template CommandOption Command::add_option(Text, std::uint32_t&, Text) const;
template CommandOption Command::add_option(Text, std::size_t&, Text) const;
template CommandOption Command::add_option(Text, double&, Text) const;
template CommandOption Command::add_option(Text, std::string&, Text) const;
template CommandOption Command::add_option(Text, std::filesystem::path&, Text) const;
template CommandOption Command::add_option(Text, std::optional<double>&, Text) const;
template CommandOption Command::add_option(Text, std::optional<int>&, Text) const;
template CommandOption Command::add_option(Text, std::optional<std::uint32_t>&, Text) const;
template CommandOption Command::add_option(Text, std::vector<double>&, Text) const;
template CommandOption Command::add_option(Text, std::vector<std::size_t>&, Text) const;
template CommandOption Command::add_option(Text, std::vector<std::uint32_t>&, Text) const;
template CommandOption Command::add_option(Text, std::vector<std::string>&, Text) const;
template CommandOption Command::add_option(Text, std::vector<std::filesystem::path>&, Text) const;
template CommandOption Command::add_option_function(Text, const std::function<void(const double&)>&,
                                                    Text) const;
template CommandOption Command::add_option_function(Text,
                                                    const std::function<void(const std::size_t&)>&,
                                                    Text) const;
template CommandOption Command::add_option_function(Text,
                                                    const std::function<void(const std::string&)>&,
                                                    Text) const;
template CommandOption Command::add_option_function(
    Text, const std::function<void(const std::vector<std::string>&)>&, Text) const;

}  // namespace km
