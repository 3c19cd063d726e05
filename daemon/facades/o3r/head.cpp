// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3r/head.h"

#include <utility>

#include "drivers/logging.h"

namespace toftwin::daemon::o3r {
namespace {

using toftwin::o3d303::Schema;

SourceLink::Wants wantsOf(bool is_3d) {
  if (!is_3d) return {.planes = {PlaneKind::Color}};
  return {.planes = {PlaneKind::Range, PlaneKind::Depth, PlaneKind::Amplitude, PlaneKind::Flags,
                     PlaneKind::Exposure}};
}

/// An empty frame tells.
bool isServed(const Schema& schema) { return writeHeadFrame(schema, toftwin::o3r::HeadFrame{}).ok(); }

Schema defaultSchemaOf(bool is_3d) {
  using namespace toftwin::o3r;
  return is_3d ? schemaOf({kDistanceBlob, kAmplitudeBlob, kConfidenceBlob, kTofInfoBlob})
               : schemaOf({kJpegBlob, kRgbInfoBlob});
}

}  // namespace

Head::Head(EventThread& thread, const FacadePlace& place, bool is_3d, Scales scales, LineFaults faults,
           Duration delay, Hooks hooks)
    : source_(place.keys.source),
      is_3d_(is_3d),
      scales_(scales),
      hooks_(std::move(hooks)),
      link_(thread, place, wantsOf(is_3d), [this](const Frame& frame) { line_.take(frame); }),
      line_(thread.io(), std::move(faults), delay,
            [this](const Frame& frame, const Damage& damage) { return publish(frame, damage); }) {}

void Head::listen(Listening listening) {
  server_.emplace(
      std::move(listening),
      ifm::PcicServer::Hooks{// Heads run by themselves.
                             .trigger = [](const auto& done) { done(ifm::PcicError::kNoTriggerAllowed); },
                             .default_schema = [this] { return defaultSchemaOf(is_3d_); },
                             .default_schema_text = [this] { return toJson(defaultSchemaOf(is_3d_)); },
                             .ask = [](std::string_view) { return std::string{}; },
                             .connections =
                                 [this](std::size_t count) {
                                   connections_ = count;
                                   update();
                                   hooks_.connections();
                                 },
                             .last_frame =
                                 [this] {
                                   if (!last_) return ifm::FrameWriter{};
                                   return ifm::FrameWriter{[this](const Schema& schema) {
                                     return writeHeadFrame(schema, last_->wire);
                                   }};
                                 },
                             .serves = isServed});
}

void Head::update() { link_.want(connections_ > 0 && hooks_.settings().is_running); }

bool Head::publish(const Frame& frame, const Damage& damage) {
  const HeadSettings settings = hooks_.settings();
  if (!settings.is_running) return false;
  temperatures_ = frame.moment.temperatures;
  if (!lens_ || lens_->camera != frame.camera) lens_ = lensModelsOf(frame.camera);
  auto images =
      is_3d_ ? images3d(frame, *lens_, scales_, settings) : images2d(frame, *lens_, scales_, settings);
  if (!images) return complainOnce(images.error()), false;
  last_ = *std::move(images);
  if (settings.tells_algorithm) server_->tellAlgorithm(toftwin::o3d303::textOf(algorithmMessage(*last_)));
  return server_->publish([this](const Schema& schema) { return writeHeadFrame(schema, last_->wire); },
                          damage);
}

void Head::complainOnce(const Error& error) {
  if (error.message != last_complaint_) logging::warn("facade o3r, head {}: {}", source_, error.message);
  last_complaint_ = error.message;
}

}  // namespace toftwin::daemon::o3r
