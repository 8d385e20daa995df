#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "apps/pgo/commands.hpp"

namespace {

constexpr const char* kAbout =
    "Works on recorded pose graphs (g2o): solves them as a team of robots in one process, or\n"
    "shows what keeps false loop closures out. Every subcommand has a --help with examples.\n"
    "Exit code: 0 if it ran, 1 for input that cannot be used.";

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(kAbout);
  app.require_subcommand(1);
  km::add_solve(app);
  km::add_pcm(app);
  km::add_outliers(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    if (app.get_subcommands().empty())
      std::cerr << "kimera_multi_pgo: the first word must be a subcommand\n" << app.help();
    else
      app.exit(error);
    return 1;
  }
  return 0;
} catch (const std::exception& error) {
  std::cerr << "kimera_multi_pgo: " << error.what() << '\n';
  return 1;
}
