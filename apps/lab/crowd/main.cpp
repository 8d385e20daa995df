#include "apps/command_line.hpp"
#include "apps/lab/crowd/commands.hpp"

namespace {

constexpr const char* kAbout =
    "Simulates the protocols of large teams whose overlap does not depend on their size: bytes,\n"
    "memory and processor time of a robot. Examples:\n"
    "  kimera_multi_crowd places config/vocabulary/indoor.kmvoc bags.txt --robots 10,30\n"
    "  kimera_multi_crowd back-end --robots 10,30\n"
    "Exit code: 0 if it ran, 1 for input that cannot be used.";

}  // namespace

int main(int argc, char** argv) {
  return km::run_subcommands("kimera_multi_crowd", kAbout,
                             {km::add_statistics, km::add_places, km::add_back_end_study}, argc,
                             argv);
}
