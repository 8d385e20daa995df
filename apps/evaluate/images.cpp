#include "apps/evaluate/images.hpp"

#include <unistd.h>

#include <fstream>
#include <iostream>
#include <optional>
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

EurocOptions options_of(const RecordingWindow& window) {
  EurocOptions options;
  options.from_s = window.from_s;
  options.to_s = window.to_s;
  return options;
}

std::vector<ImageFigure> figures_of(const fs::path& dataset, const RecordingWindow& window,
                                    const std::optional<RecordingWindow>& still,
                                    const ImageStatisticsOptions& options) {
  EurocReader reader(dataset, options_of(window));
  ImageStatistics statistics(reader.rig().stereo, options);
  for_each_pair(reader, dataset.string(), [&](const StereoFrame& frame) { statistics.add(frame); });
  if (still) {
    EurocReader rest(dataset, options_of(*still));
    for_each_pair(rest, dataset.string() + ", standing still",
                  [&](const StereoFrame& frame) { statistics.add_still(frame); });
  }
  if (!reader.report().empty())
    std::cerr << dataset.string() << ":\n" << to_string(reader.report());
  return statistics.figures();
}

std::optional<RecordingWindow> still_window(const ImagesCommand& command) {
  if (!command.still_from_s && !command.still_to_s) return std::nullopt;
  RecordingWindow window;
  window.from_s = command.still_from_s.value_or(window.from_s);
  window.to_s = command.still_to_s.value_or(window.to_s);
  return window;
}

bool has_own_window(const ImagesCommand& command) {
  return command.compare_from_s || command.compare_to_s;
}

RecordingWindow window_of_other(const ImagesCommand& command) {
  if (!has_own_window(command)) return command.window;
  RecordingWindow window;
  window.from_s = command.compare_from_s.value_or(window.from_s);
  window.to_s = command.compare_to_s.value_or(window.to_s);
  return window;
}

std::vector<ImageFigure> figures_of_other(const ImagesCommand& command) {
  const auto still = has_own_window(command) ? std::nullopt : still_window(command);
  return figures_of(command.compare, window_of_other(command), still, command.options);
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
    json.key("comparison");
    write_comparison(json, figures, other);
  }
  json.end_object();
  if (!stream.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

}  // namespace

void evaluate_images(const ImagesCommand& command) {
  // Opened for its errors alone: they come now, not after the minutes the first one takes.
  if (!command.compare.empty()) EurocReader(command.compare, options_of(window_of_other(command)));
  const auto figures =
      figures_of(command.dataset, command.window, still_window(command), command.options);
  std::vector<ImageFigure> other;
  if (command.compare.empty()) {
    std::cout << to_table(figures);
  } else {
    other = figures_of_other(command);
    std::cout << to_comparison(figures, other, command.dataset.string(), command.compare.string());
  }
  if (!command.json.empty())
    write_file(command.json, command.dataset, figures, command.compare, other);
}

}  // namespace km
