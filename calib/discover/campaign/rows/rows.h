// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include <toftwin/result.h>

#include "calib/discover/campaign/captures/campaign.h"
#include "calib/discover/campaign/captures/catalogue.h"
#include "calib/discover/campaign/captures/effect_numbers.h"
#include "calib/discover/campaign/captures/reading.h"
#include "calib/discover/campaign/captures/temperature_rates.h"
#include "calib/discover/campaign/rows/covariates.h"
#include "calib/discover/campaign/rows/unequal_exposures.h"
#include "calib/discover/campaign/rows/whitened.h"
#include "calib/discover/named_effects.h"
#include "calib/discover/term.h"

namespace toftwin::discover {

/// What a campaign's NamedFit holds: the effect, and the keys of the numbers that were fitted.
struct CampaignFit {
  sim::AnyEffect effect;
  std::vector<std::string> keys{};
};
const CampaignFit& campaignFitOf(const NamedFit& fit);

/// What stays the same at each place of the image while it moves over the scene, in units of its carrier.
struct PixelPattern {
  std::string carrier{};        ///< what it acts on: "" for the range, "gain", "delay"
  CellGrid grid{};
  std::vector<double> value{};  ///< by place in the grid; 0 where nothing is known
  double deviation = 0.0;       ///< of the pattern over the image, as estimated; 0: there is none
  std::vector<double> weight{};  ///< by place, what the captures know of it: 1/variance

  /// The share of the pattern's χ² that captures like these, in so many times as many places, can know: of values of
  /// this deviation, whose estimates err by chance, Σ w k/(k + 1) / Σ w with k = w × deviation².
  [[nodiscard]] double knownShare(double times = 1.0) const;
  /// How many numbers of the data went into it: Σ k/(k + 1).
  [[nodiscard]] double freedom() const;
};

/// A campaign's rows: measured − simulated over noise, and what each thing that could be missing
/// would add.
class CampaignRows final : public RowSource, public NamedEffects {
 public:
  struct Options {
    std::vector<std::string> left_out{};  ///< names of effects that are no candidates
    std::function<void(double)> tell{};
  };
  /// The model and the captures must outlive the rows. Errors: an exposure that the model cannot
  /// have; nothing in common with what was measured.
  static Result<CampaignRows> make(const Declared& declared, const Lit& lit,
                                   const Options& options);

  [[nodiscard]] Evidence evidence(std::span<const TermGroup> extra) const override;
  [[nodiscard]] Evidence withoutCatalogue(std::span<const TermGroup> extra) const override;
  [[nodiscard]] std::vector<CovariateInfo> covariates() const override;
  [[nodiscard]] std::vector<TermGroup> ownGroups() const override;
  [[nodiscard]] std::string wordOfCarrier(const std::string& carrier) const override;
  [[nodiscard]] const NamedEffects* named() const override { return this; }
  [[nodiscard]] std::vector<NamedFit> fitNamed(std::span<const std::string> names,
                                               std::span<const TermGroup> known,
                                               std::span<const double> scales) const override;
  [[nodiscard]] std::shared_ptr<const RowSource> including(
      std::span<const NamedFit* const> fits, bool with_catalogue) const override;
  [[nodiscard]] Term settled(Term term) const override;
  [[nodiscard]] double errorFactor(const Term& term) const override;
  /// The pattern behind a term's carrier "pixel:range", "pixel:gain" or "pixel:delay"; null: there is none.
  [[nodiscard]] const PixelPattern* patternOf(const std::string& carrier) const;

  /// Carriers of raw exposures that are not alike; empty: the camera has none that could be.
  [[nodiscard]] const std::vector<UnequalExposure>& unequal() const { return unequal_; }
  [[nodiscard]] const std::vector<Candidate>& candidates() const { return candidates_; }
  /// A covariate that is the same all over each capture, by the captures' times since power-on, ascending.
  [[nodiscard]] std::map<double, double> overTime(const std::string& covariate) const;
  /// Whether a delay of the light is another thing than an offset of the range, and a nuisance like it.
  [[nodiscard]] bool hasDelay() const { return has_delay_; }
  [[nodiscard]] const std::vector<Group>& baseGroups() const { return groups_; }
  /// Declared effects without noise, and those that were included.
  [[nodiscard]] const std::vector<sim::AnyEffect>& effects() const { return effects_; }

  /// Columns of free numbers, which take most of the time, by capture.
  struct FreeColumns {
    std::vector<std::array<Eigen::MatrixXf, kChannels>> of_capture{};
  };

  /// What a list of effects leaves. What a delay of the light does depends on them: its column is made anew.
  /// Columns: what is common to all lists (`with_numbers`: and the numbers of this source's effects), terms,
  /// and last the free numbers' derivatives. Error: an exposure that the model cannot have.
  struct Left {
    const std::vector<sim::AnyEffect>& effects;
    std::span<const FreeNumber> free{};
    std::span<const TermGroup> terms{};
    bool with_numbers = false;
    double delay_mm = 0.0;  ///< the light is so much later than in `effects`
    /// Those of another list with the same free numbers and steps, near enough to be these; null: they are made.
    const FreeColumns* columns = nullptr;
    FreeColumns* made = nullptr;  ///< takes those that are made
  };
  [[nodiscard]] Result<Evidence> evidenceLeft(const Left& left) const;

 private:
  using PerChannel = std::array<Eigen::VectorXf, kChannels>;
  /// What stays the same whatever is included.
  struct Fixed {
    std::string name{}, block{};
    std::size_t site = 0;  ///< captures of one scene and place have the same: their pixels do not move
    Cells cells;
    CaptureCovariates covariates;
    std::map<std::string, PerChannel> carriers{};
    std::array<Eigen::MatrixXf, kChannels> catalogue{};
    /// By the declared model, of the light on which effects are varied.
    std::shared_ptr<const sim::Samples> collected;
    Reading varied;          ///< what it says of that light
    PerChannel residual;     ///< of the declared model

    [[nodiscard]] PerChannel whitened(const Reading& change) const;
  };
  struct CaptureRows {
    std::shared_ptr<const Fixed> fixed;  ///< shared by sources that include different effects
    WhitenedCapture base;                ///< common columns, then numbers of effects
    std::map<std::string, PerChannel> patterns{};  ///< carriers of what stays the same at each pixel
    CaptureEvidence evidence{};          ///< of the base's columns and the catalogue's
  };
  /// Columns of terms in one capture. A covariate that is the same all over the capture only makes a column
  /// stronger, so that terms share columns: those of a curve along time are one column, times a number each.
  struct Terms {
    struct Shared {
      Eigen::MatrixXf columns{};
      std::vector<Eigen::Index> of{};  ///< of each term; −1: nothing
    };
    std::array<Shared, kChannels> channels{};
    Eigen::VectorXd scale{};  ///< of each term

    [[nodiscard]] Eigen::Index count() const { return scale.size(); }
    /// What is known of the shared columns (one row or column each), for all terms.
    [[nodiscard]] Eigen::MatrixXd columnsFor(std::size_t channel, const Eigen::MatrixXd& shared) const;
  };
  void fillFixed(std::size_t capture, const std::vector<TemperatureRate>& rates, const Reading& declared,
                 Fixed& fixed) const;
  /// What terms of coefficient 1 add to a capture: millimetres of range, per cent of light, or of their
  /// carriers.
  static PerChannel columnsOf(const CaptureRows& rows, const Term& term, const Eigen::VectorXf& values);
  static Terms termsOf(const CaptureRows& rows, std::span<const TermGroup> groups);
  /// What the base leaves of each capture, whitened; poses as they probably were.
  [[nodiscard]] std::vector<PerChannel> whatIsLeft() const;
  void findPatterns();
  void putPattern(const std::string& carrier, const std::vector<PerChannel>& left);
  static CaptureEvidence ownEvidence(const CaptureRows& rows);
  [[nodiscard]] Evidence evidenceWith(std::span<const TermGroup> extra, bool with_catalogue) const;
  [[nodiscard]] CaptureEvidence evidenceOf(const CaptureRows& rows,
                                           std::span<const TermGroup> extra,
                                           bool with_catalogue) const;
  /// `acts_on_light`: other light is collected than as declared.
  [[nodiscard]] StagedReading read(const NoiselessCamera& camera, std::size_t capture, bool acts_on_light) const;
  [[nodiscard]] Result<NoiselessCamera> cameraWith(std::vector<sim::AnyEffect> effects) const;

  const Declared* declared_ = nullptr;
  std::shared_ptr<const Lit> lit_;  ///< shared by sources that include different effects
  std::vector<UnequalExposure> unequal_;
  std::vector<Candidate> candidates_;  ///< in the order of the catalogue's groups
  std::vector<sim::AnyEffect> effects_;
  std::vector<Group> groups_;  ///< of the base, then of the catalogue
  /// Of groups that are common to all lists of effects, and of these and the effects' numbers.
  std::size_t common_columns_ = kCommon, base_columns_ = 0;
  std::vector<CaptureRows> rows_;
  std::map<std::string, PixelPattern> patterns_{};  ///< by the carrier that is made of them
  double period_m_ = 0.0, brightest_ = 0.0;  ///< of the range; amplitude in all captures
  /// What is too bright shows in the amplitude, and spills as a phasor.
  [[nodiscard]] bool hasSpilledLight() const { return period_m_ > 0.0 && brightest_ > 0.0; }
  bool has_delay_ = false;  ///< a delay of the light is another thing than an error of the range
};

}  // namespace toftwin::discover
