#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "apps/evaluate/commands.hpp"

namespace {

constexpr const char* kAbout =
    "Compares what robots estimated with what is true.\n"
    "Exit code: 0 if the comparison was made, 1 for input that cannot be used.";

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(kAbout);
  app.require_subcommand(1);
  km::add_trajectory(app);
  km::add_closures(app);
  km::add_images(app);
  km::add_mesh(app);
  km::add_render(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::RequiredError& error) {
    // A word that is not understood is why something is missing more often than not.
    const auto unknown = app.remaining(true);
    unknown.empty() ? app.exit(error) : app.exit(CLI::ExtrasError(app.get_name(), unknown));
    return 1;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 1;
  }
  return 0;
} catch (const std::exception& error) {
  std::cerr << "kimera_multi_evaluate: " << error.what() << '\n';
  return 1;
}
