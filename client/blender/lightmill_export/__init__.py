"""Exporter of Blender scenes to Lightmill's scene documents, as Cycles would render them.

It runs in Blender:

  blender --background --factory-startup --disable-autoexec SCENE.blend --python run.py -- FOLDER

FOLDER gets scene.json, its meshes and images, and report.json: {"notices": ["…"], "cameras": [{"name", "camera"}]}. A
notice names everything that a document cannot express, and what it has instead.

  scene.py      objects of the render, and the document as a whole
  meshes.py     evaluated meshes as OBJ files
  lights.py     lights, and world.py the environment
  camera.py     cameras and the film
  nodes.py      links of node trees, through groups and reroutes
  values.py     values of sockets: constants and texels; math_nodes.py has the nodes that compute them
  images.py     image textures: coordinates and files
  closures.py   shader nodes as surfaces; mixtures.py mixes and adds them; materials.py turns them into a material
  principled.py Blender's principled shader as parameters of Lightmill's
"""
