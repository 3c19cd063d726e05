// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/correct_recording.h"

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/json.h"
#include "protocol/record/recording.h"
#include "protocol/types/counted.h"
#include "sim/correction/frame_correction.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace correct_recording {

using Options = CorrectRecordingOptions;

Error refused(const std::string& what) { return {Error::Code::InvalidArgument, what}; }

/// The recording that is written, beside its place until it is whole. Without `publish` nothing stays.
class Output {
 public:
  static Result<Output> create(const std::string& file) {
    const std::filesystem::path place{file};
    std::filesystem::path beside = place.parent_path() / fmt::format(".{}.{}.part", place.filename().string(), ::getpid());
    auto writer = record::Writer::create(beside, {.overwrite = true});
    if (!writer) return Error{Error::Code::StorageFull, writer.error().message};
    return Output{place, std::move(beside), *std::move(writer)};
  }
  Output(Output&& other) noexcept : place_(std::move(other.place_)), beside_(std::exchange(other.beside_, {})), writer_(std::move(other.writer_)) {}
  Output& operator=(Output&&) = delete;
  ~Output() {
    if (beside_.empty()) return;
    (void)writer_.close();
    std::error_code ignored;
    std::filesystem::remove(beside_, ignored);
  }

  Result<> write(const Frame& frame) { return writer_.write(frame); }
  Result<> publish() {
    if (auto closed = writer_.close(); !closed) return closed;
    std::error_code fault;
    std::filesystem::rename(beside_, place_, fault);
    if (fault) return Error{Error::Code::StorageFull, fmt::format("{}: cannot write: {}", place_.string(), fault.message())};
    beside_.clear();
    return {};
  }

 private:
  Output(std::filesystem::path place, std::filesystem::path beside, record::Writer writer)
      : place_(std::move(place)), beside_(std::move(beside)), writer_(std::move(writer)) {}

  std::filesystem::path place_, beside_;  ///< `beside_` is empty once nothing is there to be removed
  record::Writer writer_;
};

/// Of pixels whose reading is valid.
struct Tally {
  std::uint64_t frames = 0, pixels = 0, with_truth = 0;
  double taken_off = 0.0, before = 0.0, after = 0.0;  ///< sums of squares, mm²

  void add(const Frame& frame, const Image<float>& measured_m, const Image<float>& corrected_m) {
    const Plane* truth = frame.find(PlaneKind::TruthRange);
    if (truth != nullptr && (truth->type != ElementType::F32 || truth->as<float>().size() != measured_m.size())) truth = nullptr;
    const Plane* flags = frame.find(PlaneKind::Flags);
    if (flags != nullptr && (flags->type != ElementType::U8 || flags->as<std::uint8_t>().size() != measured_m.size())) flags = nullptr;
    ++frames;
    for (std::size_t i = 0; i < measured_m.size(); ++i) {
      const bool is_invalid = flags != nullptr && (flags->as<std::uint8_t>()[i] & static_cast<unsigned>(PixelFlag::Invalid)) != 0;
      if (is_invalid || !std::isfinite(measured_m[i]) || !std::isfinite(corrected_m[i])) continue;
      const auto measured = static_cast<double>(measured_m[i]), corrected = static_cast<double>(corrected_m[i]);
      ++pixels, taken_off += 1e6 * (measured - corrected) * (measured - corrected);
      if (truth == nullptr || !std::isfinite(truth->as<float>()[i])) continue;
      const auto true_m = static_cast<double>(truth->as<float>()[i]);
      ++with_truth, before += 1e6 * (measured - true_m) * (measured - true_m), after += 1e6 * (corrected - true_m) * (corrected - true_m);
    }
  }
  [[nodiscard]] static double rms(double squares, std::uint64_t count) { return count == 0 ? kNaN : std::sqrt(squares / static_cast<double>(count)); }
};

/// The camera that is meant: the only one, unless one is named.
Result<std::string> sourceOf(const Options& options, const record::Summary& summary) {
  std::string known;
  for (const auto& [source, frames] : summary.frames_per_source) known += (known.empty() ? "" : ", ") + source;
  if (!options.source.empty()) {
    if (summary.frames_per_source.contains(options.source)) return options.source;
    return Error{Error::Code::NotFound, fmt::format("{}: there is no source \"{}\"; it has: {}", options.file, options.source, known.empty() ? "none" : known)};
  }
  if (summary.frames_per_source.size() == 1) return summary.frames_per_source.begin()->first;
  if (known.empty()) return refused(fmt::format("{}: it has no frames", options.file));
  return refused(fmt::format("{}: it has the sources {}, and a model is of one camera: say which with --source", options.file, known));
}

/// Corrects the frames of one camera and lets the others through.
class Work {
 public:
  Work(const Options& options, std::string source, std::shared_ptr<const sim::LearnedCorrection> model, std::optional<Output>& output)
      : options_(options), source_(std::move(source)), correction_(std::move(model)), output_(output) {}

  Result<> take(Frame frame) {
    if (frame.source == source_)
      if (auto done = correct(frame); !done) return done;
    return output_ ? output_->write(frame) : Result<>{};
  }
  [[nodiscard]] const Tally& tally() const { return tally_; }
  /// Of frames that lack what the first one had.
  [[nodiscard]] std::vector<std::string> notes() const {
    if (partly_ == 0) return {};
    return {fmt::format("{} of {} lack what the model needs: they are {}", counted(partly_, "frame"), tally_.frames, example_)};
  }

 private:
  Result<> correct(Frame& frame) {
    if (auto suits = check(frame); !suits) return suits;
    const Image<float> measured_m = correction_.rangesOf(frame);
    switch (correction_.correct(frame)) {
      case sim::FrameCorrection::Done::CorrectedBefore:
        return refused(at(frame, fmt::format("was corrected before, {}: take the recording as it was", sim::correctionOf(frame.provenance))));
      case sim::FrameCorrection::Done::WithoutRange:
        return refused(at(frame, "has its range in another form than 32-bit numbers, or not one for each pixel of its camera: it cannot be corrected"));
      case sim::FrameCorrection::Done::Corrected:
        break;
    }
    const std::string said = sim::correctionOf(frame.provenance);
    if (said.size() > sim::kCorrectedBy.size() + correction_.of().name.size()) ++partly_, example_ = said;
    tally_.add(frame, measured_m, correction_.rangesOf(frame));
    return {};
  }

  /// Whether the model is of this camera, and whether the first frame has what the model needs.
  Result<> check(const Frame& frame) const {
    std::vector<PlaneKind> planes;
    for (const Plane& plane : frame.planes) planes.push_back(plane.kind);
    if (const std::string problem = sim::problemWith(correction_.of(), planes, frame.camera); !problem.empty()) return refused(at(frame, problem));
    if (tally_.frames > 0) return {};
    const sim::Conditions now{.moment = frame.moment, .camera = frame.camera};
    const std::vector<std::string> unknown = correction_.of().terms.unknownOf(now);
    if (unknown.empty()) return {};
    return refused(at(frame, fmt::format("does not tell {}, which {} needs", unknown.front(), correction_.of().name)));
  }
  [[nodiscard]] std::string at(const Frame& frame, const std::string& what) const {
    return fmt::format("{}: {}: frame {} {}", options_.file, source_, frame.sequence, what);
  }

  const Options& options_;
  std::string source_;
  sim::FrameCorrection correction_;
  std::optional<Output>& output_;
  Tally tally_;
  std::uint64_t partly_ = 0;
  std::string example_;
};

/// Whether all could be read; damage is told and passed over, as `toftwin replay` does.
Result<bool> eachFrame(record::Reader& reader, Work& work) {
  std::uint64_t total = 0, done = 0;
  for (const auto& [source, frames] : reader.summary().frames_per_source) total += frames;
  bool is_whole = reader.summary().damage.empty();
  if (!is_whole) fmt::print(stderr, "{}\n", reader.summary().damage);
  Progress progress{"frames", total};
  while (true) {
    if (interrupted()) return Error{Error::Code::Stopped, fmt::format("stopped after {}; nothing was written", counted(done, "frame"))};
    auto frame = reader.next();
    if (frame) {
      if (auto taken = work.take(*std::move(frame)); !taken) return taken.error();
      progress.show(++done);
    } else if (frame.error().code == Error::Code::EndOfStream) {
      return is_whole;
    } else {
      fmt::print(stderr, "{}\n", frame.error().message);
      is_whole = false;
    }
  }
}

void print(const Options& options, const std::string& model, const Tally& t, const std::vector<std::string>& notes) {
  const double taken_off = Tally::rms(t.taken_off, t.pixels), before = Tally::rms(t.before, t.with_truth), after = Tally::rms(t.after, t.with_truth);
  if (options.json) {
    using compare::Json;
    Json json = Json::object();
    json.set("frames", t.frames).set("pixels", t.pixels).set("has_reference", t.with_truth > 0).set("pixels_with_reference", t.with_truth);
    json.set("rms_before_mm", before).set("rms_after_mm", after).set("rms_taken_off_mm", taken_off).set("model", model);
    fmt::print("{}\n", json.set("notes", Json::arrayOf(notes)).text());
    return;
  }
  fmt::print("{}, {} with a range: {:.4g} mm (RMS) taken off by {}.\n", counted(t.frames, "frame"), counted(t.pixels, "pixel"), taken_off, model);
  if (t.with_truth > 0) fmt::print("{} with the true range: RMS {:.4g} mm before, {:.4g} mm after.\n", counted(t.with_truth, "pixel"), before, after);
  else fmt::print("The frames have no true range (plane truth_range), so that nobody can say what is left.\n");
  for (const std::string& note : notes) fmt::print("note: {}\n", note);
}

Result<> checkOutput(const Options& options) {
  if (options.output.empty()) return {};
  if (std::filesystem::path{options.output}.extension() != ".mcap")
    return refused(fmt::format("-o {}: what comes of a recording is one: name it FILE.mcap", options.output));
  std::error_code ignored;
  if (std::filesystem::equivalent(options.output, options.file, ignored))
    return refused(fmt::format("{}: is the recording itself; write the corrected one beside it", options.output));
  if (!options.force && std::filesystem::exists(options.output, ignored))
    return refused(fmt::format("{}: there is such a file already; --force replaces it", options.output));
  return {};
}

}  // namespace correct_recording

Result<Exit> correctRecording(const CorrectRecordingOptions& options) {
  using namespace correct_recording;
  if (auto can = checkOutput(options); !can) return can.error();
  auto model = sim::readCorrection(options.model);
  if (!model) return model.error();
  auto reader = record::Reader::open(options.file);
  if (!reader) return reader.error();
  auto source = sourceOf(options, reader->summary());
  if (!source) return source.error();
  std::optional<Output> output;
  if (!options.output.empty()) {
    auto created = Output::create(options.output);
    if (!created) return created.error();
    output.emplace(*std::move(created));
  }
  catchInterrupts();
  const std::string name = (*model)->name;
  Work work{options, *std::move(source), *std::move(model), output};
  const auto is_whole = eachFrame(*reader, work);
  if (!is_whole) return is_whole.error();
  if (output)
    if (auto published = output->publish(); !published) return published.error();
  print(options, name, work.tally(), work.notes());
  return *is_whole ? Exit::Ok : Exit::Incomplete;
}

}  // namespace toftwin::cli
