#include "apps/program_options.hpp"

#include <algorithm>
#include <iostream>

#include "apps/program_version.hpp"
#include "apps/shipped_file.hpp"

namespace km {

std::optional<int> parse_options(CLI::App& app, int argc, const char* const* argv,
                                 const std::string& hint_for_unknown) {
  app.set_version_flag("--version", version_text(app.get_name()))->group("Options");
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::RequiredError& error) {
    auto unknown = app.remaining(true);
    std::ranges::reverse(unknown);  // ExtrasError lists the last one first
    if (unknown.empty())
      app.exit(error);
    else
      app.exit(CLI::ExtrasError(app.get_name(), unknown));
  } catch (const CLI::ExtrasError& error) {
    app.exit(error);
    std::cerr << hint_for_unknown;
  } catch (const CLI::ParseError& error) {
    if (app.exit(error) == 0) return 0;  // --help, --version or CLI::Success
  }
  return kBadCommandLine;
}

CLI::Validator named_file(const char* folder) {
  return {[folder](std::string& text) {
            text = find_named_file(folder, text).string();
            return std::string();
          },
          "FILE|NAME"};
}

int run_subcommands(const std::string& program, const std::string& about,
                    std::initializer_list<void (*)(CLI::App&)> adders, int argc, char** argv) try {
  CLI::App app(about, program);
  app.require_subcommand(1);
  app.footer(program + " SUBCOMMAND --help has the details, and examples.");
  for (const auto add : adders) add(app);
  const std::optional<int> exit_code = parse_options(app, argc, argv);
  if (exit_code.value_or(0) == 0) return 0;
  if (!app.get_subcommands().empty()) return *exit_code;
  std::cerr << program << ": the first word must be a subcommand:\n";
  for (const CLI::App* one : app.get_subcommands(nullptr))
    std::cerr << "  " << one->get_name() << "  " << one->get_description() << '\n';
  return *exit_code;
} catch (const std::exception& error) {
  std::cerr << program << ": " << error.what() << '\n';
  return kBadInput;
}

}  // namespace km
