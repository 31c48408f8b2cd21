"""Lines of the program with --verify that read and write files: every pixel type, tiles, parts, windows, channels, NaN."""
import os
import subprocess

# Made once, by the program without a fault; tools of OpenImageIO join the parts.
PICTURES = """
--pattern perlin:freq=7:seed=3 301x203 4 --mulc 0.4,0.5,0.6,0.3 --addc 0.5,0.5,0.4,0.7 -d float -o float.exr
float.exr -d uint8 -o rgba8.tif
float.exr --ch R,G,B -d uint8 -o rgb8.png
float.exr --ch R,G,B -d uint16 -o rgb16.png
float.exr --ch G -d uint8 -o grey8.png
float.exr --ch R,G,B -d uint16 -o rgb16.sgi
float.exr --ch R,G,B -d uint8 -o rgb8.bmp
float.exr --ch R,G,B -d float -o rgb.tif
float.exr --crop 211x131+37+41 -d half -o window.exr
float.exr --attrib tile_width 64 --attrib tile_height 32 -d half -o tiled.exr
float.exr --attrib tile_width 64 --attrib tile_height 48 -d uint16 -o tiled.tif
window.exr --attrib tile_width 32 --attrib tile_height 32 -d half -o tilewindow.exr
--pattern simplex:freq=5 2301x1203 4 --mulc 0.4 --addc 0.5 -d uint8 -o large.tif
""".strip().splitlines()
JOINED = "float.exr --ch R,G,B -d half window.exr --siappend -o parts.exr"

LINES = """
rgb8.png --mulc 0.8,0.9,1.1 -d uint8 --verify -o out.png
rgb16.png --hue 20 -d uint16 --verify -o out.png
grey8.png --powc 1.3 -d uint16 --verify -o out.tif
rgba8.tif --ch 2,1,0,3 -d uint8 --verify -o out.tif
rgb.tif --saturate 0.6 -d float --verify -o out.tif
window.exr --blur 5x5 --mulc 0.5 -d half --verify -o out.exr
window.exr --crop 260x180+20+20 --addc 0.1 -d half --verify -o out.exr
window.exr --crop 211x131+37+41 -d uint8 --verify -o out.png
tiled.exr --blur 9x9 -d half --verify -o out.exr
tilewindow.exr --blur 5x5 -d float --verify -o out.exr
tiled.tif --ch 2,1 --addc 0.01 -d uint16 --verify -o out.tif
rgba8.tif --attrib tile_width 64 --attrib tile_height 48 --blur 3x3 -d uint8 --verify -o out.tif
float.exr --attrib tile_width 32 --attrib tile_height 64 --mulc 0.9 -d float --verify -o out.exr
float.exr --ch R,G,B --mulc 0.02 --subc 0.01,1,0.01 window.exr --ch R,G,B --envmap:map=latlong -d float --verify -o out.exr
--volume:solid=knot:mode=over:method=shearwarp:size=80x80 -d float --verify -o out.exr
float.exr --ch R,G window.exr --lookup:filter=mipmap -d float --verify -o out.exr
--pattern checker:width=5:height=3 60x40-20-10 3 -d half --verify -o out.exr
rgb16.png --median 5x5 -d uint16 --verify -o out.png
rgb.tif --blur:sigma=9 -d float --verify -o out.tif
rgb.tif --blur:sigma=4:method=recursive:wrap=mirror -d float --verify -o out.tif
rgb.tif --dilate 7x7 -d float --verify -o out.tif
rgb.tif --blur 13x3 -d float --verify -o out.tif
--pattern perlin:lattice=osl:color=1 80x60 4 -d float --verify -o out.exr
--pattern perlin:freq=5:signed=1 96x64 2 --lic:length=12 -d float --verify -o out.exr
--max-memory 1 large.tif --attrib tile_width 64 --attrib tile_height 64 --mulc 0.9 -d half --verify -o out.exr
-i:subimage=1 parts.exr --ch G,B --mulc 0.7 -d half --verify -o out.exr
float.exr rgba8.tif --over -d half --verify -o out.exr
float.exr --subc 0.5 --powc 0.5 --clamp:max=0.4 -d float --verify -o out.exr
float.exr --subc 0.5 --powc 0.5 float.exr --max -d half --verify -o out.exr
large.tif --blur 3x3 --mulc 0.9 -d uint8 --verify -o out.tif
rgb16.sgi --ch B,G --mulc 0.9 -d uint16 --verify -o out.tif
rgb8.bmp --ch B --powc 1.3 -d uint8 --verify -o out.png
--codec oiio float.exr --ch G,A --mulc 0.7 -d half --verify -o out.exr
--codec oiio rgba8.tif --ch 1,2 --addc 0.1 -d uint8 --verify -o out.tif
--codec oiio rgb16.png --ch B --powc 1.1 -d uint16 --verify -o out.png
--pattern perlin:freq=3 1x5 3 -d float --verify -o out.tif
--pattern perlin:freq=3 3x1 1 -d float --verify -o out.tif
--pattern perlin:freq=3 1x1 4 -d half --verify -o out.exr
--pattern perlin:freq=3 1x5 2 -d uint16 --verify -o out.png
--pattern perlin:freq=3 1x5 3 -d uint16 --verify -o out.sgi
""".strip().splitlines()


def make_pictures(program, folder):
    for line in PICTURES:
        if not os.path.exists(os.path.join(folder, line.split()[-1])):
            subprocess.run([program, *line.split()], cwd=folder, check=True)
    subprocess.run(["oiiotool", *JOINED.split()], cwd=folder, check=True)
