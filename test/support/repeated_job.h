// A job that is rendered again and again, whole or cut short, and all that it makes.
#pragma once
#include "support/built_smoke.h"
#include "wisp/layers.h"
#include "wisp/photon_sums.h"
#include "wisp/pixel_sums.h"
#include <string>

namespace wisp::WISP_ARITH {

class RepeatedJob {
  public:
    RepeatedJob(const Scene &scene, const Settings &settings)
        : scene_(scene), settings_(settings), plan_(renderer.plan(scene, settings)), rgb_(3 * pixels()),
          layers_(planes_of(plan_.layers) * pixels()), sums_(pixels()), photons_(plan_.map_sums) {}

    const Plan &plan() const { return plan_; }

    // What the job makes is unmade before.
    Status run(Arena &arena, FrameCache *cache, const Observer &observer = {}) {
        unmake();
        Statistics statistics;
        PhotonSums photons = {photons_.data(), photons_.size(), 0};
        Job job = {scene_, settings_, arena, statistics, observer, rgb_.data()};
        job.cache = cache;
        job.pixels = sums_.data();
        job.layers = settings_.layers ? layers_.data() : nullptr;
        job.batches = all_batches(settings_);
        if (settings_.goal == Goal::photons) job.photons = &photons;
        return renderer.render(job);
    }
    // All that the last run has made. Photon sums of a run that is not done are of no use.
    std::string made() const {
        std::string bytes;
        const auto add = [&bytes](const auto &values) {
            bytes.append(reinterpret_cast<const char *>(values.data()), values.size() * sizeof(values[0]));
        };
        add(rgb_);
        add(layers_);
        add(sums_);
        if (settings_.goal == Goal::photons) add(photons_);
        return bytes;
    }
    bool made_nothing() const {
        RepeatedJob other = *this;
        other.unmake();
        return made() == other.made();
    }

  private:
    size_t pixels() const { return settings_.crop.pixels(); }
    void unmake() {
        rgb_.assign(rgb_.size(), -7);
        layers_.assign(layers_.size(), -7);
        sums_.assign(sums_.size(), PixelSums{});
        photons_.assign(photons_.size(), 0);
    }

    const Scene &scene_;
    Settings settings_;
    Plan plan_;
    std::vector<float> rgb_, layers_;
    std::vector<PixelSums> sums_;
    std::vector<int64_t> photons_;
};

} // namespace wisp::WISP_ARITH
