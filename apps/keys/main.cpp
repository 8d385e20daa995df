#include "apps/command_line.hpp"
#include "apps/keys/commands.hpp"

namespace {

constexpr const char* kAbout =
    "Keys of a team: who may take part. The team's authority gives each robot a key and a\n"
    "certificate; robots that are started with them (--security) accept messages of\n"
    "each other only, and no other program can read them. Examples:\n"
    "  kimera_multi_keys make survey --robots alpha:0,beta:1   # name:id of each robot\n"
    "  scp -rp survey/alpha alpha.local:keys                   # its folder goes onto the robot\n"
    "  kimera_multi_keys add survey --robots gamma:2           # later, one more\n"
    "  kimera_multi_keys revoke survey beta                    # beta is lost\n"
    "  kimera_multi_keys show survey\n"
    "Keep survey/authority off the robots, and a copy of it in a safe place: its owner can\n"
    "admit any robot to the team, and without it no robot can be added or revoked.\n"
    "Every subcommand has a --help. Exit code: 0 if it was done, 1 if not.";

}  // namespace

int main(int argc, char** argv) {
  return km::run_subcommands("kimera_multi_keys", kAbout,
                             {km::add_make, km::add_add, km::add_revoke, km::add_show}, argc, argv);
}
