#include <malloc.h>

#include <exception>
#include <filesystem>
#include <iostream>
#include <set>
#include <thread>

#include "apps/program_options.hpp"
#include "apps/viewer/page_message.hpp"
#include "apps/viewer/page_server.hpp"
#include "apps/viewer/run_playback.hpp"
#include "apps/viewer/view_store.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/view/node/view_listener_node.hpp"
#include "runtime/clock.hpp"
#include "runtime/dds/dds_config.hpp"
#include "runtime/log.hpp"
#include "runtime/signal_watch.hpp"

namespace km {
namespace {

constexpr const char* kAbout =
    R"(Shows a team in a browser, during a run or afterwards. Prints the address to open.

The page shows map, objects, trajectories and loop closures in 3D, and the state of the robots: who
receives whom, cost, bytes, loads, memory. Its time slider goes back to any moment, also during the run.)";

constexpr const char* kFooter = R"(
RESULTS is the folder of a team or of one robot, also if it still runs or was killed. Everything appears
at the time at which the robot knew it, with two exceptions. Meshes are those of the end of the run: each
chunk appears at the time at which the robot saw its surface. Objects, 2D map and the team's mesh
appear at the end of the run.

With --domain the viewer joins the DDS domain of a running team as a listener; robots do not wait for it.
Robots that run with --view send about 2 kB/s, chunks of the map as they change, and small camera images
while a page shows them.

In the page: drag to turn, right button to move, wheel to zoom; double click on a robot's name to
follow it; measure: two clicks on the map. Keys: space plays and stops, T from above, F all in view.

Only this host can open the page. With --listen every program that knows the address can: the address has
a random token, a new one for every run, and the content is not encrypted.

Examples
  kimera_multi_viewer --domain 7                     # a team that runs
  kimera_multi_viewer --domain 7 --peers 10.0.0.2,10.0.0.3   # without multicast
  kimera_multi_viewer results/demo                   # a run that has ended
  kimera_multi_viewer results/demo --listen 0.0.0.0  # for other hosts

Exit codes: 0 ended by Ctrl-C; 1 unusable input or an address in use; 2 bad command line.)";

struct ViewerOptions {
  std::filesystem::path results, palette;
  DdsConfig dds;
  PageServerOptions server;
  double memory_MB = 500.0;
};

void define(CLI::App& app, ViewerOptions& options) {
  app.footer(kFooter);
  CLI::Option* const results = app.add_option("RESULTS", options.results, "Results of a run");
  CLI::Option* const domain = app.add_option(
      "--domain", options.dds.domain, "DDS domain of the team, whose robots run with --view");
  domain->check(CLI::Range(0, 230))->excludes(results);
  app.add_option("--team", options.dds.team, "dds.team of the robots")
      ->needs(domain)
      ->capture_default_str();
  app.add_option("--interface", options.dds.interface, "Network interface, e.g. lo")->needs(domain);
  app.add_option("--peers", options.dds.peers,
                 "Addresses of the robots' hosts, where multicast is off")
      ->delimiter(',')
      ->needs(domain);
  app.add_option(
      "--palette", options.palette,
      "label_palette.csv with names and colours of the labels (default: that of RESULTS)");
  app.add_option("--port", options.server.port, "Port of the page; 0: any free port")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  app.add_option("--listen", options.server.address,
                 "Address of this host to listen on; 0.0.0.0 for all. Except for loopback "
                 "addresses, the URL has a token")
      ->capture_default_str();
  app.add_option("--memory", options.memory_MB,
                 "Memory for messages [MB]. Beyond it the oldest images, then the oldest replaced "
                 "meshes, are discarded")
      ->check(CLI::Range(10.0, 1e6))
      ->capture_default_str();
  app.callback([results, domain] {
    if (results->count() + domain->count() == 0)
      throw CLI::ValidationError("give RESULTS of a run, or --domain of a team that runs");
  });
}

void wait_for_end(SignalWatch& signals) {
  while (!signals.wait(1.0)) {
  }
}

LabelPalette palette_of(const ViewerOptions& options) {
  if (options.palette.empty()) return {};
  return parse_label_palette(read_input_file(options.palette), options.palette.string());
}

void print_address(const PageServer& server) {
  std::cout << "Open " << server.url() << "   (Ctrl-C ends)" << std::endl;
}

void show_run(ViewerOptions options, ViewStore& store, SignalWatch& signals) {
  RunPlayback run = read_run(options.results, nanoseconds(wall_now_s()));
  for (const std::string& note : run.notes) log::warn("viewer") << note;
  const std::string title = std::filesystem::canonical(options.results).filename().string();
  options.server.hello = hello_message(PageSource::kRun, title,
                                       options.palette.empty() ? run.palette : palette_of(options));
  const PageServer server(store, options.server);
  print_address(server);
  for (ViewUpdate& update : run.updates) store.add(std::move(update));
  run = {};
  wait_for_end(signals);
}

void show_team(ViewerOptions options, ViewStore& store, SignalWatch& signals) {
  if (!options.dds.peers.empty()) options.dds.discovery = Discovery::kPeers;
  ViewListener listener(options.dds);
  const std::string title = "domain " + std::to_string(options.dds.domain);
  options.server.hello = hello_message(PageSource::kTeam, title, palette_of(options));
  options.server.on_images = [&](const std::set<RobotId>& robots) {
    listener.ask_for_images(robots);
  };
  const PageServer server(store, options.server);
  std::jthread receiver([&](const std::stop_token& stop) {
    while (!stop.stop_requested())
      if (auto update = listener.next(1.0)) store.add(*std::move(update));
  });
  log::info("viewer") << title << " on " << listener.interface().name << " ("
                      << listener.interface().address
                      << "): shows robots that run with --view (or view.on: true)";
  print_address(server);
  wait_for_end(signals);
  receiver.request_stop();
  listener.stop();
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) try {
  CLI::App app(km::kAbout, "kimera_multi_viewer");
  km::ViewerOptions options;
  km::define(app, options);
  if (const auto exit_code = km::parse_options(app, argc, argv)) return *exit_code;
  // The memory of a large frame that a page sends goes back to the system with the frame.
  mallopt(M_MMAP_THRESHOLD, 1 << 20);
  km::SignalWatch signals;  // before any thread: threads inherit the blocked signals
  km::ViewStore store(static_cast<std::size_t>(options.memory_MB * 1e6));
  (options.results.empty() ? km::show_team : km::show_run)(options, store, signals);
  return 0;
} catch (const std::exception& error) {
  std::cerr << "kimera_multi_viewer: " << error.what() << '\n';
  return km::kBadInput;
}
