"""Writes the pictures of this folder: 24 x 16 pixels by Pillow, libjpeg's cjpeg and imagecodecs, one kind of file each."""

import subprocess

import imagecodecs
import numpy
from PIL import Image

W, H = 24, 16
places = [(x, y) for y in range(H) for x in range(W)]


def picture(blue):
    out = Image.new("RGB", (W, H))
    out.putdata([(255 * x // (W - 1), 255 * y // (H - 1), blue(x, y)) for x, y in places])
    return out


grainy = picture(lambda x, y: (x * 11 + y * 7) % 256)
smooth = picture(lambda x, y: 128)
rgba = Image.merge("RGBA", (*grainy.split(), grainy.getchannel("G")))

smooth.convert("CMYK").save("cmyk.jpg", quality=95, subsampling=0)
smooth.convert("CMYK").save("cmyk.tif")
smooth.save("progressive.jpg", quality=95, progressive=True, subsampling=0)
smooth.save("subsampled.jpg", quality=95, subsampling=2)
Image.merge("LA", (grainy.convert("L"), grainy.getchannel("R"))).save("grey_alpha.png")
rgba.save("rgba.png")
for mode, name in [("P", "palette"), ("1", "one_bit")]:
    grainy.convert(mode).save(name + ".png")
    grainy.convert(mode).save(name + ".tif")
for name, compression in [("lzw", "tiff_lzw"), ("deflate", "tiff_adobe_deflate"), ("packbits", "packbits")]:
    rgba.save(name + ".tif", compression=compression)
grainy.convert("L").save("grey.tif")
grainy.save("jpeg.tif", compression="jpeg")
grey = (numpy.arange(W * H).reshape(H, W) * 170 % 65536).astype(numpy.uint16)
Image.fromarray(grey).save("grey16.png")

smooth.save("smooth.ppm")
cjpeg = ["cjpeg", "-quality", "95", "-sample", "1x1"]
subprocess.run([*cjpeg, "-arithmetic", "-outfile", "arithmetic.jpg", "smooth.ppm"], check=True)
subprocess.run(["rm", "smooth.ppm"], check=True)
twelve = numpy.asarray(smooth).astype(numpy.uint16) << 4
open("twelve_bits.jpg", "wb").write(imagecodecs.jpeg8_encode(twelve, bitspersample=12))
