// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/calibrate.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "calib/intrinsics/brightness.h"
#include "tools/cli/prompter.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace live_calibration {

using namespace intrinsics;

/// In words that stay the same from frame to frame.
std::string whyNot(const Sighting& sighting) {
  switch (sighting.rejection) {
    case Rejection::None: return "it moves; hold it still";
    case Rejection::NotFound:
      return sighting.has_more ? "the board has more corners than --board says" : "no board is seen: show all of it";
    case Rejection::CornerOutliers: return "corners are covered, cut off or blurred by motion";
    case Rejection::Blurred: return "it is blurred; hold it still, or farther away";
    case Rejection::TooOblique: return "it is tilted by 75 degrees or more";
    case Rejection::TooSmall: return "it is too small in the image; bring it nearer";
    case Rejection::LikeAnother: return "it is like a view that was taken; move it, or tilt it by 20 degrees";
    case Rejection::SameImage:            // of files
    case Rejection::ReprojectionOutlier:  // of a lens, which is not known yet
      break;
  }
  return "";
}

/// The views so far as a lens, once there are a few; nothing while they do not tell it.
std::optional<Estimate> soFar(const Collector& collector) {
  constexpr std::ptrdiff_t kFew = 6;
  auto sightings = collector.sightings();
  if (std::ranges::count_if(sightings, &Sighting::isUsed) < kFew) return std::nullopt;
  auto result = estimate(collector.target(), sightings, collector.size(),
                         {.model = LensModel::K1K2, .degree = 0, .folds = 0});
  return result ? std::optional{*std::move(result)} : std::nullopt;
}

/// In which a board can be seen.
Result<PlaneKind> planeOf(Client& client, const std::string& source) {
  const auto details = client.describe(source);
  if (!details) return details.error();
  for (const PlaneKind kind : {PlaneKind::Amplitude, PlaneKind::Ambient}) {
    if (std::ranges::find(details->planes, kind) != details->planes.end()) return kind;
  }
  return Error{Error::Code::Unsupported,
               fmt::format("{} has no amplitude plane, in which a board could be seen", source)};
}

Guidance guidanceFor(const Collector& collector) {
  const auto lens = soFar(collector);
  return guide(collector.target(), collector.sightings(), collector.size(), lens ? &*lens : nullptr);
}

}  // namespace live_calibration

Result<> collectLive(const DaemonOptions& daemon, const LiveOptions& live, intrinsics::Collector& collector,
                     const OnView& on_view) {
  using namespace live_calibration;
  auto client = daemon.connect();
  if (!client) return client.error();
  const auto plane = planeOf(*client, live.source);
  if (!plane) return plane.error();
  auto frames = client->subscribe(live.source, {.planes = {*plane}});
  if (!frames) return frames.error();
  Prompter prompter{[](const std::string& text) { fmt::print(stderr, "{}", text); }};
  Searches searches;
  prompter.sayOnce("show the board and hold it still; Ctrl-C ends\n");
  std::optional<Sighting> before;
  int views = 0;
  while (!interrupted() && views < live.most_views) {
    const auto frame = waitForFrame(*frames, daemon.timeout());
    if (!frame && frame.error().code == Error::Code::Stopped) break;
    if (!frame && views == 0) return frame.error();
    if (!frame) {
      fmt::print(stderr, "no more frames ({}); the {} views so far are used\n", frame.error().message, views);
      break;
    }
    auto brightness = brightnessOf(*frame);
    if (!brightness) return brightness.error();
    const NamedImage image{fmt::format("{} frame {}", live.source, frame->sequence), *std::move(brightness)};
    DetectOptions how = collector.options();
    how.is_thorough = searches.isThorough();
    Sighting sighting = findBoard(image.brightness, collector.target(), how);
    sighting.name = image.name;
    const bool is_so = searches.add(sighting);
    // Two frames that agree: the board is held still, so the exposures of one frame agree as well.
    const bool is_still = before && sighting.isUsed() && movedBy(*before, sighting) < kStill_px;
    const bool is_alike = is_still && collector.isLikeAnother(sighting);
    if (is_alike) sighting.rejection = Rejection::LikeAnother;
    if (is_so && (!is_still || is_alike)) prompter.whyNot(live_calibration::whyNot(sighting));
    before = sighting.isUsed() || is_alike ? std::optional{sighting} : std::nullopt;
    if (!is_still) continue;  // a board that took the thorough search is looked for so once more
    searches.beginAnew();
    if (is_alike) continue;
    const ImageSize size{image.brightness.width(), image.brightness.height()};
    if (auto added = collector.add(std::move(sighting), size); !added) return added;
    on_view(image);
    ++views;
    const Guidance guidance = guidanceFor(collector);
    prompter.tell(guidance);
    if (guidance.isEnough() && live.until_enough) break;
  }
  return {};
}

}  // namespace toftwin::cli
