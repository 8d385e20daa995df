#include "apps/evaluate/commands.hpp"
#include "apps/program_options.hpp"

namespace {

constexpr const char* kAbout =
    R"(Compares what robots estimated with what is true.
Exit code: 0 if the comparison was made, 1 for input that cannot be used, 2 for a bad command line.)";

}  // namespace

int main(int argc, char** argv) {
  return km::run_subcommands(
      "kimera_multi_evaluate", kAbout,
      {km::add_trajectory, km::add_consistency, km::add_mesh, km::add_objects, km::add_render,
#ifdef KM_GLTF
       km::add_glb
#endif
      },
      argc, argv);
}
