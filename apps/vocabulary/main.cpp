#include "apps/program_options.hpp"
#include "apps/vocabulary/commands.hpp"

namespace {

constexpr const char* kAbout =
    R"(Vocabularies of visual words: what place recognition compares images by.
All robots of a team need the same vocabulary file.

IMAGES are image files, folders of .png or .jpg, EuRoC/ASL folders (their left camera), or
text files that list one image per line. Examples:
  kimera_multi_vocabulary train -o site.kmvoc -k 10 -L 4 recording_1 recording_2
  kimera_multi_vocabulary inspect site.kmvoc --pair a.png b.png)";

}  // namespace

int main(int argc, char** argv) {
  return km::run_subcommands("kimera_multi_vocabulary", kAbout, {km::add_train, km::add_inspect},
                             argc, argv);
}
