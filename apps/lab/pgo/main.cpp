#include "apps/lab/pgo/commands.hpp"
#include "apps/program_options.hpp"

namespace {

constexpr const char* kAbout =
    "Works on recorded pose graphs (g2o, CSV, JRL): solves them as a team of robots in one "
    "process, or\n"
    "shows what keeps false loop closures out. Every subcommand has a --help with examples.\n"
    "Exit code: 0 if it ran, 1 for input that cannot be used, 2 for a bad command line.";

}  // namespace

int main(int argc, char** argv) {
  return km::run_subcommands("kimera_multi_pgo", kAbout,
                             {km::add_solve, km::add_pcm, km::add_outliers}, argc, argv);
}
