// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <toftwin/image.h>

#include "sim/tracer/irradiance_cells.h"
#include "sim/tracer/path.h"

namespace toftwin::sim {

/// Numbers on the coarse grid, one image each. Point (i, j) is what the central ray of pixel
/// (kStep i, kStep j) meets; the last row and column lie on the image's last pixels.
struct CoarseGrid {
  static constexpr int kStep = 4;

  void resize(int width, int height, std::size_t channels, std::size_t frequencies);
  void resizeWithLit(int width, int height, std::size_t channels, std::size_t frequencies);

  int width = 0, height = 0;
  Image<float> x, y, z;  ///< place, in the camera's frame
  Image<float> normal_x, normal_y, normal_z;
  Image<float> samples;        ///< how many count in the means; 0 where there is no surface
  Image<float> variance_left;  ///< the means' variance as a share of a single sample's
  std::vector<Image<float>> means;  ///< of the light that falls in, by channel (Channels)
  std::vector<Image<float>> squares;  ///< by frequency: mean |first harmonic|² of single samples
  // The part of it that lit places are expected to send; in the smooth grid empty.
  std::vector<Image<float>> lit, lit_squares;
  Image<float> lit_left;
  Image<int> mover;  ///< 0 where the surface stands still, else 1 + the number of the moving object
};

/// The numbers that are kept of light: steady, ambient, and both parts of each phasor that is wanted. Of
/// every frequency the first harmonic is.
class Channels {
 public:
  /// Those that are at least so well seen, by term of the request (Light::phasors); if `seen` is empty, all.
  explicit Channels(const TraceRequest& request = {}, std::span<const SeenHarmonic> seen = {},
                    Harmonic least = Harmonic::Faint);
  /// A phasor without an image of its own: what it adds to its frequency's first one.
  struct Fold {
    std::size_t phasor, first;
    std::complex<float> weight;
    bool is_mirrored;
    bool operator==(const Fold&) const = default;
  };
  bool operator==(const Channels&) const = default;

  static constexpr std::size_t kSteady = 0, kAmbient = 1;
  static constexpr std::size_t re(std::size_t phasor) { return 2 + 2 * phasor; }
  static constexpr std::size_t im(std::size_t phasor) { return 3 + 2 * phasor; }
  [[nodiscard]] std::size_t count() const { return 2 + 2 * terms_.size(); }
  /// Which terms are wanted, ascending; phasor k is that of terms()[k], and in LaneSums that of lanes()[k].
  [[nodiscard]] const std::vector<std::size_t>& terms() const { return terms_; }
  [[nodiscard]] const std::vector<std::size_t>& lanes() const { return lanes_; }
  /// Which harmonic each phasor is of.
  [[nodiscard]] const std::vector<int>& ordersOfTerms() const { return orders_of_terms_; }
  /// The harmonics that any frequency wants: Tracing::orders.
  [[nodiscard]] const std::vector<int>& orders() const { return orders_; }
  /// Each frequency's last that is wanted.
  [[nodiscard]] const std::vector<int>& lastOrders() const { return last_orders_; }
  [[nodiscard]] const std::vector<Fold>& folds() const { return folds_; }
  /// The terms that are not folded, with the phasor of each.
  struct Shown {
    std::size_t term, phasor;
    bool operator==(const Shown&) const = default;
  };
  [[nodiscard]] const std::vector<Shown>& shown() const { return shown_; }
  /// The phasor of a frequency's first harmonic.
  [[nodiscard]] std::size_t first(std::size_t frequency) const { return firsts_[frequency]; }

 private:
  std::vector<std::size_t> terms_, lanes_, firsts_;
  std::vector<int> orders_of_terms_, orders_, last_orders_;
  std::vector<Fold> folds_;
  std::vector<Shown> shown_;
};

/// Adds weight · light · exp(−i 2π n f L/c), channel by channel, to the sums' terms.
void addTurned(const Tracing& tracing, const Channels& channels, const Lanes<float>& weight,
               const Lanes<double>& length, const std::vector<Lanes<float>>& light, LaneSums& sums);

/// What the full image's pixels of one 4 × 4 block are, for spreading coarse light onto them.
struct BlockGeometry {
  Lanes<float> x, y, z, normal_x, normal_y, normal_z;  ///< camera's frame; zero where nothing
};

/// What else counts of them; zero where nothing.
struct BlockTruth {
  Lanes<float> range_m, albedo;
};

class KeptDirect;
class LitPoints;

/// Where the camera and all that moves is.
struct Places {
  Places() = default;
  explicit Places(const Tracing& tracing);
  Transform<World, Camera> scene_from_camera;
  std::vector<Transform<World, Object>> scene_from_movers;
};

/// One packet's worth of light over two surfaces for the cells.
struct CellUpdate {
  Lanes<IrradianceCells::Key> keys{};  ///< 0: none
  std::vector<Lanes<float>> values;    ///< by channel
};

/// What a tile's central rays met, as long as it stays where it is.
struct SeenTile {
  std::uint32_t frame = 0;  ///< in which they were traced; 0: never
  Lanes<int> valid, mover;
  Vec3Lanes position, normal;
  Vec3fLanes start;
};

/// What the four coarse points around a block count for each of its pixels, times the pixel's albedo; likewise.
struct CornerWeights {
  std::uint32_t frame = 0;
  std::array<Lanes<float>, 4> of;
};

/// Light that reaches surfaces over other surfaces, kept over frames. Means are of incoming radiance,
/// weighted with the cosine and without the way to the camera: neither albedo nor place of the camera
/// is in them, so they are as smooth as the light is.
class IndirectLight {
 public:
  IndirectLight();
  IndirectLight(IndirectLight&&) noexcept;
  IndirectLight& operator=(IndirectLight&&) noexcept;
  ~IndirectLight();

  /// Takes `samples` more for each coarse point. `kept` says which surfaces are where they were.
  void gather(const Tracing& tracing, const Channels& channels, const KeptDirect& kept, int samples);
  /// Share of coarse points on a surface that had nothing to go on from earlier calls.
  [[nodiscard]] double shareOfNew() const { return share_of_new_; }
  /// Smoothes along surfaces; before spread().
  void smooth();

  /// What spread() writes, and room for it to work.
  struct Spread {
    Spread(const Channels& channels, std::size_t frequencies);
    LaneSums sums;
    std::vector<Lanes<float>> variance;  ///< by frequency
    std::vector<Lanes<float>> light;
  };
  /// The light that the pixels of the block at (left, top) send to the camera. By several threads for several blocks.
  void spread(const Tracing& tracing, int left, int top, const BlockGeometry& pixels, const BlockTruth& truth,
              const KeptDirect& kept, Spread& out);

 private:
  /// How many samples count in means at most.
  struct Memory {
    float points, lit, moving;
    int cells;
  };
  [[nodiscard]] Memory memoryFor(const Tracing& tracing, int samples) const;
  void takeHistory(const CoarseGrid& before, const Tracing& tracing, const Places& now, const Memory& memory);

  std::string scene_id_;
  Channels channels_;
  std::vector<Frequency> frequencies_;
  CoarseGrid grid_, before_;
  CoarseGrid smooth_;  ///< `squares` holds variances of the means
  Places places_;  ///< of the last call
  std::unique_ptr<IrradianceCells> cells_;
  std::unique_ptr<LitPoints> lights_;
  std::vector<CellUpdate> updates_;  ///< of this frame, in memory of the last
  std::vector<SeenTile> seen_;              ///< by tile
  std::vector<CornerWeights> weights_;      ///< by block of pixels
  std::uint32_t samples_done_ = 0;
  double share_of_new_ = 1.0;
};

}  // namespace toftwin::sim
