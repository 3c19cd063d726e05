// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "daemon/corrected_source.h"
#include "drivers/logging.h"
#include "sim/correction/frame_correction.h"

namespace toftwin::daemon {
namespace {

constexpr std::string_view kParameter = "correction";

/// All calls go through; frames come corrected.
class CorrectedSource final : public drivers::Source {
 public:
  CorrectedSource(std::shared_ptr<const sim::LearnedCorrection> correction, std::unique_ptr<Source> inner)
      : correction_(std::move(correction)), inner_(std::move(inner)) {
    noteInfo();
  }

  [[nodiscard]] const drivers::SourceInfo& info() const override { return info_; }
  Result<> start() override { return inner_->start(); }
  void stop() override { inner_->stop(); }
  [[nodiscard]] drivers::SourceState state() const override {
    drivers::SourceState state = inner_->state();
    state.parameters.push_back({.name = std::string{kParameter}, .text = correction_.of().name});
    return state;
  }
  Result<> setPose(const Transform<World, Camera>& pose) override { return inner_->setPose(pose); }
  Result<> setParameter(std::string_view name, double value) override {
    if (name == kParameter) return fixed();
    return noted(inner_->setParameter(name, value));
  }
  Result<> setParameterText(std::string_view name, std::string_view text) override {
    if (name == kParameter) return text == correction_.of().name ? Result<>{} : fixed();
    return noted(inner_->setParameterText(name, text));
  }
  Result<> trigger() override { return inner_->trigger(); }

  Result<Frame> next(std::stop_token stop, bool lockstep) override {
    Result<Frame> frame = inner_->next(std::move(stop), lockstep);
    noteInfo();
    if (frame) correct(*frame);
    return frame;
  }

 private:
  static Error fixed() {
    return {Error::Code::Unsupported, "the correction is set by the key `correction` of the source's [[source]] table"};
  }
  Result<> noted(Result<> done) {
    noteInfo();
    return done;
  }
  /// Parameters of the inner source may change its planes.
  void noteInfo() {
    info_ = inner_->info();
    info_.parameters.emplace_back(kParameter);
  }

  void correct(Frame& frame) {
    if (correction_.correct(frame) == sim::FrameCorrection::Done::CorrectedBefore && !std::exchange(is_told_, true))
      logging::warn("its frames are corrected already: {} is not taken off again", correction_.of().name);
  }

  sim::FrameCorrection correction_;
  std::unique_ptr<Source> inner_;
  drivers::SourceInfo info_;
  bool is_told_ = false;
};

}  // namespace

Result<std::unique_ptr<drivers::Source>> corrected(std::shared_ptr<const sim::LearnedCorrection> correction,
                                                   Result<std::unique_ptr<drivers::Source>> opened) {
  if (!correction || !opened || *opened == nullptr) return opened;
  return std::unique_ptr<drivers::Source>{
      std::make_unique<CorrectedSource>(std::move(correction), *std::move(opened))};
}

}  // namespace toftwin::daemon
