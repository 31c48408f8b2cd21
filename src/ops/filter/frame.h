// What a filter with wrap=clamp sees around a data window that does not fill its display window: black.
#ifndef TESSERA_OPS_FILTER_FRAME_H_
#define TESSERA_OPS_FILTER_FRAME_H_

#include "tessera/node.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {

// filter(image). Where the display window is wider than the data window, one pixel of its black joins the
// image meanwhile, which clamping then repeats: pixels nearer to the data are black as far as the display
// window goes, and beyond it the nearest pixel of the whole picture is black too.
template <class F>
Node InDisplayWindow(const Node& image, Wrap wrap, F filter) {
  const Roi &data = image.spec().data_window, &display = image.spec().display_window;
  if (data.empty() || display.empty() || wrap != Wrap::kClamp) return filter(image);
  const Roi framed = {
      display.x0 < data.x0 ? data.x0 - 1 : data.x0, display.y0 < data.y0 ? data.y0 - 1 : data.y0,
      display.x1 > data.x1 ? data.x1 + 1 : data.x1, display.y1 > data.y1 ? data.y1 + 1 : data.y1};
  return framed == data ? filter(image) : Crop(filter(Crop(image, framed)), data);
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_FRAME_H_
