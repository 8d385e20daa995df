#pragma once

namespace CLI {
class App;
}

namespace km {

/// Add a subcommand of kimera_multi_pgo to `app`, which runs as soon as the command line names it.
/// Input that cannot be used throws a std::exception that says why.
void add_solve(CLI::App& app);
void add_pcm(CLI::App& app);
void add_outliers(CLI::App& app);

}  // namespace km
