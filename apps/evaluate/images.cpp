#include "apps/evaluate/images.hpp"

#include <unistd.h>

#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "modules/core/json_writer.hpp"
#include "modules/evaluation/images/image_report.hpp"
#include "modules/sensors/euroc_reader.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// A line on standard error that is rewritten; silent where nobody looks.
class Progress {
 public:
  Progress(std::string what, std::size_t total) : what_(std::move(what)), total_(total) {}
  ~Progress() {
    if (shown_) std::cerr << "\r\x1b[K" << std::flush;
  }
  void step() {
    ++done_;
    const std::size_t percent = total_ > 0 ? 100 * done_ / total_ : 100;
    if (!shown_ || percent == percent_) return;
    percent_ = percent;
    std::cerr << '\r' << what_ << ": " << done_ << " of " << total_ << " stereo pairs, " << percent
              << " %" << std::flush;
  }

 private:
  std::string what_;
  std::size_t total_;
  std::size_t done_ = 0;
  std::size_t percent_ = 0;
  bool shown_ = isatty(STDERR_FILENO) == 1;
};

template <typename Use>
void for_each_pair(EurocReader& reader, const std::string& what, const Use& use) {
  Progress progress(what, reader.pair_count());
  while (const auto packet = reader.next()) {
    use(*packet->frame);
    progress.step();
  }
}

std::vector<ImageFigure> figures_of(const fs::path& dataset, const ImagesCommand& command) {
  EurocOptions window;
  window.from_s = command.from_s;
  window.to_s = command.to_s;
  EurocReader reader(dataset, window);
  ImageStatistics statistics(reader.rig().stereo, command.options);
  for_each_pair(reader, dataset.string(), [&](const StereoFrame& frame) { statistics.add(frame); });
  if (command.still_from_s || command.still_to_s) {
    EurocOptions still;
    still.from_s = command.still_from_s.value_or(0.0);
    still.to_s = command.still_to_s.value_or(still.to_s);
    EurocReader rest(dataset, still);
    for_each_pair(rest, dataset.string() + ", standing still",
                  [&](const StereoFrame& frame) { statistics.add_still(frame); });
  }
  if (!reader.report().empty())
    std::cerr << dataset.string() << ":\n" << to_string(reader.report());
  return statistics.figures();
}

void write_file(const fs::path& file, const fs::path& dataset,
                const std::vector<ImageFigure>& figures, const fs::path& compare,
                const std::vector<ImageFigure>& other) {
  std::ofstream stream(file);
  JsonWriter json(stream);
  json.begin_object();
  json.field("dataset", dataset.string());
  json.key("figures");
  write_json(json, figures);
  if (!compare.empty()) {
    json.field("compared_with", compare.string());
    json.key("compared_figures");
    write_json(json, other);
  }
  json.end_object();
  if (!stream.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

}  // namespace

void evaluate_images(const ImagesCommand& command) {
  const auto figures = figures_of(command.dataset, command);
  std::vector<ImageFigure> other;
  if (command.compare.empty()) {
    std::cout << to_table(figures);
  } else {
    other = figures_of(command.compare, command);
    std::cout << to_comparison(figures, other, command.dataset.string(), command.compare.string());
  }
  if (!command.json.empty())
    write_file(command.json, command.dataset, figures, command.compare, other);
}

}  // namespace km
