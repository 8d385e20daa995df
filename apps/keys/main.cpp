#include "apps/keys/commands.hpp"
#include "apps/program_options.hpp"

namespace {

constexpr const char* kAbout =
    R"(Keys of a team. The team's authority gives each robot a key and a certificate. Robots that are
started with them (--security) accept messages of each other only, and no other program can read
these messages. Examples:
  kimera_multi_keys make survey --robots alpha:0,beta:1   # name:id of each robot
  scp -rp survey/alpha alpha.local:keys                   # copy its folder onto the robot
  kimera_multi_keys add survey --robots gamma:2           # later, one more
  kimera_multi_keys revoke survey beta                    # beta is lost
  kimera_multi_keys show survey
Keep survey/authority off the robots, and a copy of it in a safe place: its owner can admit
any robot to the team, and without it no robot can be added or revoked.
Every subcommand has a --help. Exit code: 0 for success, 1 otherwise.)";

}  // namespace

int main(int argc, char** argv) {
  return km::run_subcommands("kimera_multi_keys", kAbout,
                             {km::add_make, km::add_add, km::add_revoke, km::add_show}, argc, argv);
}
