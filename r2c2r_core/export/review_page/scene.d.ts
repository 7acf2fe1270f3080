/** What the page holds about the scene, as review.py writes it. */

export interface Mesh {
  low: number[];
  span: number[];
  positions: string;
  uv: string;
  indices: string;
  texture: number;
  colour: number[];
}

export interface Joint {
  name: string;
  kind: "revolute" | "prismatic";
  axis: number[];
  lower: number;
  upper: number;
}

export interface Body {
  name: string;
  object: string;
  parent: number;
  pose: number[];
  joint: Joint | null;
  surface: Mesh | null;
  colliders: Mesh | null;
}

export interface Finding {
  severity: string;
  message: string;
  object: string | null;
}

export interface Scene {
  name: string;
  passed: boolean;
  bodies: Body[];
  textures: string[];
  objects: { name: string; text: string }[];
  findings: Finding[];
  yaw: number;
}
