#pragma once

namespace CLI {
class App;
}

namespace km {

/// Add a subcommand of kimera_multi_evaluate to `app`, which runs as soon as the command line names
/// it: it prints tables and writes the files asked for. Input that cannot be used throws an
/// exception whose message is one line.
void add_trajectory(CLI::App& app);
void add_closures(CLI::App& app);
void add_images(CLI::App& app);
void add_mesh(CLI::App& app);
void add_render(CLI::App& app);

}  // namespace km
