// The affine operation's algebra: validation, identity, folding in double.
#include "ops/color/affine.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

namespace tessera::ops {
namespace {

bool IsFloat(double v) { return v == 0 || (std::fabs(v) <= 3.4028234e38 && std::fabs(v) >= 1.2e-38); }

double Apply(const Limits& l, double v) {
  if (std::isnan(v)) return l.nan;
  if (v < l.low) v = l.low;
  if (v > l.high) v = l.high;
  return v;
}
// First a, then b.
Limits Then(const Limits& a, const Limits& b) {
  if (!b.any()) return a;
  Limits both{Apply(b, a.low), Apply(b, a.high), Apply(b, a.nan)};
  return both;
}

// The image has a fourth value apart from R, G, B.
bool HasAlpha(const AffineParams& p) { return p.alpha >= 3 && p.alpha < p.channels; }

bool HasLimits(const AffineParams& p) {
  return std::any_of(p.limits.begin(), p.limits.end(), [](const Limits& l) { return l.any(); });
}

bool IsUnit(const AffineParams& p) {
  if (p.structure == AffineClass::kDiagonal) {
    return std::all_of(p.scale.begin(), p.scale.end(), [](double s) { return s == 1; }) &&
           std::all_of(p.bias.begin(), p.bias.end(), [](double b) { return b == 0; });
  }
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 5; ++j) {
      if (p.matrix[i][j] != (i == j)) return false;
    }
  }
  return true;
}

// The same as a colour matrix, when no channel but R, G, B and alpha is touched.
std::optional<AffineParams> AsColor(const AffineParams& p) {
  if (p.structure != AffineClass::kDiagonal) return p;
  if (p.channels < 3 || (p.alpha >= 0 && p.alpha < 3)) return std::nullopt;
  AffineParams color;
  color.channels = p.channels, color.alpha = p.alpha, color.structure = AffineClass::kRgb;
  color.limits.assign(4, Limits());
  for (int c = 0; c < p.channels; ++c) {
    const size_t i = static_cast<size_t>(c);
    if (c >= 3 && c != p.alpha) {
      if (p.scale[i] != 1 || p.bias[i] != 0 || p.limits[i].any()) return std::nullopt;
      continue;
    }
    const int row = c < 3 ? c : 3;
    color.matrix[row][row] = p.scale[i];
    color.matrix[row][4] = p.bias[i];
    color.limits[static_cast<size_t>(row)] = p.limits[i];
  }
  return color;
}

std::string Number(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", v);
  return text;
}

class AffineOp final : public graph::Op {
 public:
  AffineOp(std::string name, AffineParams p, std::any parameters)
      : name_(std::move(name)), parameters_(std::move(parameters)), p_(std::move(p)) {
    if (p_.structure == AffineClass::kDiagonal) {
      p_.scale.resize(static_cast<size_t>(p_.channels), 1.0);
      p_.bias.resize(static_cast<size_t>(p_.channels), 0.0);
      p_.limits.resize(static_cast<size_t>(p_.channels));
    } else {
      p_.limits.resize(4);
      if (!HasAlpha(p_)) {
        for (int j = 0; j < 5; ++j) p_.matrix[3][j] = j == 3;
        p_.limits[3] = Limits();
      }
    }
  }

  std::string Name() const override { return name_; }
  graph::OpKind Kind() const override {
    return p_.structure == AffineClass::kDiagonal ? graph::OpKind::kChannel : graph::OpKind::kColor;
  }
  const std::any& Parameters() const override { return parameters_; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    if (p_.structure != AffineClass::kDiagonal) graph::RequireColor(name_, inputs[0]);
    return inputs[0];
  }

  std::string Describe() const override {
    std::string text = name_;
    if (p_.structure != AffineClass::kDiagonal) {
      text += p_.structure == AffineClass::kRgb ? " 3x3" : " 4x4";
      for (int i = 0; i < 4; ++i) {
        if (p_.matrix[i][4] == 0) continue;
        text.append("+bias");
        break;
      }
    } else if (!IsUnit(p_)) {
      text.append(" x").append(Number(p_.scale.empty() ? 1 : p_.scale[0]));
      if (!p_.bias.empty() && p_.bias[0] != 0) text.append("+").append(Number(p_.bias[0]));
    }
    if (HasLimits(p_) && name_ != "clamp") text.append("+clamp");
    return text;
  }

  bool IsIdentity() const override { return IsUnit(p_) && !HasLimits(p_); }

  std::shared_ptr<const Op> Compose(const Op& next) const override {
    const auto* const other = dynamic_cast<const AffineOp*>(&next);
    if (other == nullptr || other->p_.channels != p_.channels || other->p_.alpha != p_.alpha) return nullptr;
    const bool only_limits = IsUnit(other->p_);
    if (HasLimits(p_) && !only_limits) return nullptr;  // limits stand between the two matrices
    std::optional<AffineParams> both;
    if (p_.structure == AffineClass::kDiagonal && other->p_.structure == AffineClass::kDiagonal) {
      both = ComposeDiagonal(other->p_);
    } else {
      const auto first = AsColor(p_), second = AsColor(other->p_);
      if (first && second) both = ComposeColor(*first, *second);
    }
    if (!both) return nullptr;
    return std::make_shared<const AffineOp>("affine", std::move(*both), std::any());
  }

  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    if (p_.structure != AffineClass::kDiagonal) {
      const Limits limits[4] = {p_.limits[0], p_.limits[1], p_.limits[2], p_.limits[3]};
      return MakeAffineStage(p_.structure, p_.matrix, limits);
    }
    double m[4][5] = {};
    Limits limits[4];
    for (int i = 0; i < 4; ++i) {
      const int c = context.channels[i];
      m[i][i] = 1;
      if (c < 0 || c >= p_.channels) continue;
      const size_t k = static_cast<size_t>(c);
      m[i][i] = p_.scale[k], m[i][4] = p_.bias[k], limits[i] = p_.limits[k];
    }
    return MakeAffineStage(p_.structure, m, limits);
  }

  bool WritesAlpha() const override {
    if (p_.structure == AffineClass::kDiagonal || !HasAlpha(p_)) return false;
    for (int j = 0; j < 5; ++j) {
      if (p_.matrix[3][j] != (j == 3)) return true;
    }
    return p_.structure == AffineClass::kFull || p_.limits[3].any();
  }
  bool ReadsAlpha() const override { return p_.structure == AffineClass::kFull || WritesAlpha(); }

 private:
  std::optional<AffineParams> ComposeDiagonal(const AffineParams& next) const {
    AffineParams both = p_;
    for (size_t c = 0; c < both.scale.size(); ++c) {
      both.scale[c] = next.scale[c] * p_.scale[c];
      both.bias[c] = next.scale[c] * p_.bias[c] + next.bias[c];
      both.limits[c] = Then(p_.limits[c], next.limits[c]);
      if (!IsFloat(both.scale[c]) || !IsFloat(both.bias[c])) return std::nullopt;
    }
    return both;
  }

  static std::optional<AffineParams> ComposeColor(const AffineParams& first, const AffineParams& second) {
    AffineParams both = first;
    both.structure = std::max(first.structure, second.structure);
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 5; ++j) {
        double sum = j == 4 ? second.matrix[i][4] : 0;
        for (int k = 0; k < 4; ++k) sum += second.matrix[i][k] * first.matrix[k][j];
        both.matrix[i][j] = sum;
        // Products that float cannot hold would change the result; sums that cancel to almost nothing do not.
        if (std::fabs(sum) > 3.4028234e38) return std::nullopt;
      }
      both.limits[static_cast<size_t>(i)] =
          Then(first.limits[static_cast<size_t>(i)], second.limits[static_cast<size_t>(i)]);
    }
    return both;
  }

  std::string name_;
  std::any parameters_;
  AffineParams p_;
};

}  // namespace

Limits MakeLimits(double low, double high) {
  Limits l{low, high};
  if (low != -kNoLimit) {
    l.nan = low;
  } else if (high != kNoLimit) {
    l.nan = high;
  }
  return l;
}

std::shared_ptr<const graph::Op> MakeAffine(std::string name, AffineParams affine, std::any parameters) {
  return std::make_shared<const AffineOp>(std::move(name), std::move(affine), std::move(parameters));
}

}  // namespace tessera::ops
