#pragma once

#include "apps/command_line.hpp"

namespace km {

/// Each adds a subcommand of kimera_multi_evaluate to `app`, which runs as soon as the command line
/// names it. A subcommand prints tables and writes the requested files. Unusable input throws an
/// exception with a message of one line.
void add_trajectory(Command app);
void add_closures(Command app);
void add_consistency(Command app);
void add_images(Command app);
void add_mesh(Command app);
void add_copies(Command app);
void add_render(Command app);
void add_objects(Command app);
void add_colmap(Command app);
void add_glb(Command app);

}  // namespace km
